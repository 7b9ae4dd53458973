/* The tangent of all unknowns, eliminated front by front; see ringsim/frame/elimination.py. */

#include "core.h"

/* Pivot over the sum of its row's entries in the front.  Elimination without exchange loses as many
   digits; Newton renews what they spoil, but not without end. */
static const D LEAST_PIVOT = 1e-9;
/* Unknowns of a panel at most, and columns at a time of what it leaves. */
enum { PANEL = 16, WIDE = 24, EIGHT = 8 };
/* Rows at once of what is taken off eight columns: a sum waits for the one before. */
enum { ROWS = 4 };

/* Invert a panel's own block of so many rows (Gauss and Jordan), on lanes that hold all its columns;
   false if a pivot is too small beside the rest of its row. */
static inline bool invert(const D *a, I columns, I gone, I left, D *out, const int lanes) {
    V r[PANEL][PANEL / LANES];
    bool sound = true;
    for (I i = 0; i < gone; i++)
        for (int q = 0; q < lanes; q++) r[i][q] = take(a + i * columns + LANES * q);
    const V first = {0.0, 1.0, 2.0, 3.0};
    for (I k = 0; k < gone; k++) {
        V sums = all(0.0);
        I j = 0;
        for (; j + LANES <= left; j += LANES) sums += size_of(take(a + k * columns + j));
        D sum = (sums[0] + sums[2]) + (sums[1] + sums[3]);
        for (; j < left; j++) sum += fabs(a[k * columns + j]);
        D pivot = ((const D *)r[k])[k], column[PANEL];
        sound &= fabs(pivot) > LEAST_PIVOT * sum;
        for (I i = 0; i < gone; i++) column[i] = ((const D *)r[i])[k];
        V inverse = all(1.0 / pivot);
        V own[PANEL / LANES], other[PANEL / LANES];
        for (int q = 0; q < lanes; q++) {
            /* No single number is put into a row: loading all four would wait for it. */
            Mask unit = first + (D)(LANES * q) == all((D)k);
            other[q] = (V)(~unit & (Mask)all(1.0));
            own[q] = (r[k][q] * other[q] + (1.0 - other[q])) * inverse;
        }
        for (I i = 0; i < gone; i++) {
            if (i == k) continue;
            V by = all(column[i]);
            for (int q = 0; q < lanes; q++) r[i][q] = r[i][q] * other[q] - by * own[q];
        }
        for (int q = 0; q < lanes; q++) r[k][q] = own[q];
    }
    for (I i = 0; i < gone; i++)
        for (int q = 0; q < lanes; q++) put(out + PANEL * i + LANES * q, r[i][q]);
    return sound;
}

/* Columns of a row that stays, less what the panel's rows take from them. */
static inline void take_off(D *left, const D *row, const D *a, I columns, I gone, const D *share,
                            const int lanes) {
    V x[WIDE / LANES];
    for (int q = 0; q < lanes; q++) x[q] = take(row + LANES * q);
    for (I k = 0; k < gone; k++) {
        V by = all(share[k]);
        for (int q = 0; q < lanes; q++) x[q] -= by * take(a + k * columns + LANES * q);
    }
    for (int q = 0; q < lanes; q++) put(left + LANES * q, x[q]);
}

/* Add so many numbers at rising places: those of a body are neighbours, as are those of bodies that
   follow each other. */
static inline void add_at(D *to, const I *places, const D *numbers, I count) {
    I j = 0;
    while (j + LANES <= count) {
        D *own = to + places[j];
        if (places[j + LANES - 1] - places[j] == LANES - 1) {
            put(own, take(own) + take(numbers + j));
            j += LANES;
        } else
            *own += numbers[j++];
    }
    for (; j < count; j++) to[places[j]] += numbers[j];
}

/* Eliminate the rows of a front that stay; those of its last panel are added to its parent. */
static inline void reduce(D *a, I columns, I begin, I gone, I size, const D *inverse, const I *up,
                          D *parent, const int lanes) {
    I end = begin + gone;
    const D *panel = a + begin * columns;
    for (I i = end; i < size; i++) {
        D *row = a + i * columns, share[PANEL], left[WIDE];
        V low[PANEL / LANES];
        for (int q = 0; q < lanes; q++) low[q] = all(0.0);
        for (I k = 0; k < gone; k++) {
            V by = all(row[begin + k]);
            for (int q = 0; q < lanes; q++) low[q] += by * take(inverse + PANEL * k + LANES * q);
        }
        for (int q = 0; q < lanes; q++) put(share + LANES * q, low[q]);
        for (I first = end; first < size; first += WIDE) {
            I count = size - first < WIDE ? size - first : WIDE;
            if (count > 2 * EIGHT)
                take_off(left, row + first, panel + first, columns, gone, share, WIDE / LANES);
            else if (count > EIGHT)
                take_off(left, row + first, panel + first, columns, gone, share, 2 * EIGHT / LANES);
            else
                take_off(left, row + first, panel + first, columns, gone, share, EIGHT / LANES);
            if (parent)
                add_at(parent + up[i] * columns, up + first, left, count);
            else
                memcpy(row + first, left, (size_t)count * sizeof(D));
        }
        memcpy(row + begin, share, (size_t)gone * sizeof(D));
    }
}

/* Eliminate all fronts, in place; false where a pivot is too small. */
bool factor(const Mesh *mesh, const Fronts *fronts) {
    bool sound = true;
    I columns = fronts->columns;
    for (I p = 0; p < fronts->panels.n; p++) {
        const I *panel = fronts->panels.at + 3 * p;
        I number = panel[0], begin = panel[1], gone = panel[2], size = mesh->size.at[number];
        D *a = front_of(fronts, number), *inverse = fronts->inverse.at + PANEL * PANEL * p;
        const I *spots = mesh->spots.at + number * mesh->spots.each;
        for (I f = 0; f < mesh->fixed.n; f++)
            for (I k = begin; k < begin + gone; k++)
                if (spots[k] == mesh->fixed.at[f]) {
                    for (I j = begin; j < size; j++) a[k * columns + j] = a[j * columns + k] = 0.0;
                    a[k * columns + k] = 1.0;
                }
        D *own = a + begin * columns + begin;
        bool small = gone <= 3 * LANES;
        sound &= small ? invert(own, columns, gone, size - begin, inverse, 3)
                       : invert(own, columns, gone, size - begin, inverse, 4);
        if (begin + gone == size) continue;
        bool last = begin + gone == mesh->gone.at[number];
        D *parent = last ? front_of(fronts, mesh->parent.at[number]) : NULL;
        const I *up = mesh->up.at + number * mesh->up.each;
        if (small)
            reduce(a, columns, begin, gone, size, inverse, up, parent, 3);
        else
            reduce(a, columns, begin, gone, size, inverse, up, parent, 4);
    }
    return sound;
}

/* Take rows of numbers from first to last, times eight columns whose rows are so far apart, off their
   sums. */
static inline void take_times(V sums[ROWS][2], const D *const rows[ROWS], I first, I last,
                              const D *columns, I apart) {
    for (I k = first; k < last; k++) {
        V low = take(columns + k * apart), high = take(columns + k * apart + LANES);
        for (int r = 0; r < ROWS; r++) sums[r][0] -= rows[r][k] * low, sums[r][1] -= rows[r][k] * high;
    }
}

/* Replace eight right-hand sides, whose rows are so far apart, by solutions.  Where fewer rows are left
   than are taken at once the last one stands for those that are not. */
static void solve_eight(const Mesh *mesh, const Fronts *fronts, D *x, I apart) {
    I columns = fronts->columns;
    V b[mesh->spots.each][2], known[PANEL][2], sums[ROWS][2];
    const D *rows[ROWS];
    for (I p = 0; p < fronts->panels.n; p++) {
        const I *panel = fronts->panels.at + 3 * p;
        I begin = panel[1], gone = panel[2], size = mesh->size.at[panel[0]];
        const D *a = front_of(fronts, panel[0]);
        const I *spots = mesh->spots.at + panel[0] * mesh->spots.each;
        /* What other fronts have added to them: they do not move. */
        for (I f = 0; f < mesh->fixed.n; f++) {
            D *own = x + mesh->fixed.at[f] * apart;
            put(own, all(0.0)), put(own + LANES, all(0.0));
        }
        Mask pulled = {0};
        for (I k = 0; k < gone; k++) {
            const D *own = x + spots[begin + k] * apart;
            known[k][0] = take(own), known[k][1] = take(own + LANES);
            pulled |= (known[k][0] != 0.0) | (known[k][1] != 0.0);
        }
        /* A pulley pulls on spans behind it alone. */
        if (!any(pulled)) continue;
        for (I i = begin + gone; i < size; i += ROWS) {
            I live = size - i < ROWS ? size - i : ROWS;
            for (I r = 0; r < ROWS; r++) {
                I row = r < live ? i + r : size - 1;
                const D *own = x + spots[row] * apart;
                rows[r] = a + row * columns + begin, sums[r][0] = take(own), sums[r][1] = take(own + LANES);
            }
            take_times(sums, rows, 0, gone, (const D *)known, EIGHT);
            for (I r = 0; r < live; r++) {
                D *own = x + spots[i + r] * apart;
                put(own, sums[r][0]), put(own + LANES, sums[r][1]);
            }
        }
    }
    for (I p = fronts->panels.n - 1; p >= 0; p--) {
        const I *panel = fronts->panels.at + 3 * p;
        I begin = panel[1], gone = panel[2], size = mesh->size.at[panel[0]], end = begin + gone;
        const D *a = front_of(fronts, panel[0]), *inverse = fronts->inverse.at + PANEL * PANEL * p;
        const I *spots = mesh->spots.at + panel[0] * mesh->spots.each;
        for (I k = begin; k < size; k++) {
            const D *own = x + spots[k] * apart;
            b[k][0] = take(own), b[k][1] = take(own + LANES);
        }
        for (I i = 0; i < gone; i += ROWS) {
            for (I r = 0; r < ROWS; r++) {
                I row = begin + (i + r < gone ? i + r : gone - 1);
                rows[r] = a + row * columns, sums[r][0] = b[row][0], sums[r][1] = b[row][1];
            }
            take_times(sums, rows, end, size, (const D *)b, EIGHT);
            for (I r = 0; r < ROWS && i + r < gone; r++)
                known[i + r][0] = sums[r][0], known[i + r][1] = sums[r][1];
        }
        for (I i = 0; i < gone; i++) {
            V p0 = all(0.0), p1 = all(0.0);
            for (I k = 0; k < gone; k++) {
                D share = inverse[PANEL * i + k];
                p0 += share * known[k][0], p1 += share * known[k][1];
            }
            D *own = x + spots[begin + i] * apart;
            put(own, p0), put(own + LANES, p1);
        }
    }
}

/* Replace right-hand sides, shape (unknowns, a multiple of eight), by solutions. */
void solve(const Mesh *mesh, const Fronts *fronts, D *x, I n_x) {
    I apart = n_x / mesh->unknowns;
    for (I column = 0; column < apart; column += EIGHT) solve_eight(mesh, fronts, x + column, apart);
}

static inline D product(const D *a, const D *b, I n) {
    V low = all(0.0), high = all(0.0);
    I k = 0;
    for (; k + EIGHT <= n; k += EIGHT) {
        low += take(a + k) * take(b + k);
        high += take(a + k + LANES) * take(b + k + LANES);
    }
    low += high;
    D sum = (low[0] + low[2]) + (low[1] + low[3]);
    for (; k < n; k++) sum += a[k] * b[k];
    return sum;
}

/* The same of one right-hand side, shape (unknowns,). */
void solve_one(const Mesh *mesh, const Fronts *fronts, D *x, I n_x) {
    (void)n_x;
    I columns = fronts->columns;
    D b[mesh->spots.each + 1], known[PANEL];
    for (I p = 0; p < fronts->panels.n; p++) {
        const I *panel = fronts->panels.at + 3 * p;
        I begin = panel[1], gone = panel[2], size = mesh->size.at[panel[0]];
        const D *a = front_of(fronts, panel[0]) + begin;
        const I *spots = mesh->spots.at + panel[0] * mesh->spots.each;
        for (I f = 0; f < mesh->fixed.n; f++) x[mesh->fixed.at[f]] = 0.0;
        for (I k = 0; k < gone; k++) known[k] = x[spots[begin + k]];
        for (I i = begin + gone; i < size; i++) x[spots[i]] -= product(a + i * columns, known, gone);
    }
    for (I p = fronts->panels.n - 1; p >= 0; p--) {
        const I *panel = fronts->panels.at + 3 * p;
        I begin = panel[1], gone = panel[2], end = begin + gone, kept = mesh->size.at[panel[0]] - end;
        const D *a = front_of(fronts, panel[0]), *inverse = fronts->inverse.at + PANEL * PANEL * p;
        const I *spots = mesh->spots.at + panel[0] * mesh->spots.each;
        for (I k = 0; k < kept; k++) b[k] = x[spots[end + k]];
        for (I i = 0; i < gone; i++)
            known[i] = x[spots[begin + i]] - product(a + (begin + i) * columns + end, b, kept);
        for (I i = 0; i < gone; i++) x[spots[begin + i]] = product(inverse + PANEL * i, known, gone);
    }
}

/* Take rows, shape (count, size), times columns, (size, n) with n eights, off a corner, (count, n). */
void take_rows(const D *rows, I count, I size, const D *columns, I n, D *corner) {
    for (I i = 0; i < count; i += ROWS) {
        I live = count - i < ROWS ? count - i : ROWS, first = size, last = 0;
        const D *own[ROWS];
        for (I r = 0; r < ROWS; r++) {
            own[r] = rows + (r < live ? i + r : count - 1) * size;
            /* A rope's rows have nothing of the others. */
            I begin = 0, end = size;
            while (begin < end && own[r][begin] == 0.0) begin++;
            while (begin < end && own[r][end - 1] == 0.0) end--;
            if (begin < end) first = begin < first ? begin : first, last = end > last ? end : last;
        }
        for (I j = 0; j < n; j += EIGHT) {
            D *to = corner + i * n + j;
            V sums[ROWS][2];
            for (I r = 0; r < ROWS; r++) {
                const D *from = to + (r < live ? r : live - 1) * n;
                sums[r][0] = take(from), sums[r][1] = take(from + LANES);
            }
            take_times(sums, own, first, last, columns + j, n);
            for (I r = 0; r < live; r++) put(to + r * n, sums[r][0]), put(to + r * n + LANES, sums[r][1]);
        }
    }
}

/* Factor the border's own block D - R^T K^-1 C, whose columns are eights, with exchange of rows; its
   columns C become K^-1 C.  False if it is singular.

   Rows of ropes are what their tensions change with, after the places of the points, behind how
   these move with the unknowns. */
bool close_border(const System *system, const Roped *roped) {
    const Mesh *mesh = &system->mesh;
    const Border *border = &roped->border;
    I n = border->used.at[WIDE_USED], factors = border->used.at[FACTORS], of_hub = border->used.at[OF_HUB];
    D *a = border->corner.at, *columns = border->columns.at;
    solve(mesh, &system->fronts, columns, mesh->unknowns * n);
    take_rows(border->hub.at, of_hub, mesh->unknowns, columns, n, a);
    if (factors > 0) {
        I size = 3 * system->paths.frame.n;
        move_paths(&system->paths, mesh, &system->arms, columns, n, border->moved.at);
        take_rows(roped->factors.at + factors * size, factors, size, border->moved.at, n, a + of_hub * n);
    }
    for (I k = 0; k < n; k++) {
        I best = k;
        for (I i = k + 1; i < n; i++)
            if (fabs(a[i * n + k]) > fabs(a[best * n + k])) best = i;
        if (!(fabs(a[best * n + k]) > 0.0)) return false;
        border->pivots.at[k] = best;
        for (I j = 0; best != k && j < n; j++) {
            D kept = a[k * n + j];
            a[k * n + j] = a[best * n + j], a[best * n + j] = kept;
        }
        for (I i = k + 1; i < n; i++) {
            D share = a[i * n + k] /= a[k * n + k];
            if (share != 0.0)
                for (I j = k + 1; j < n; j++) a[i * n + j] -= share * a[k * n + j];
        }
    }
    return true;
}

/* A solution x of the fronts alone becomes that of all; behind the fronts' unknowns come those of a
   hub.  Points move by arms as they are now, which turn little between two tangents. */
void cross_border(const System *system, const Roped *roped, D *x) {
    const Border *border = &roped->border;
    I unknowns = system->mesh.unknowns, size = 3 * system->paths.frame.n;
    I n = border->used.at[WIDE_USED], factors = border->used.at[FACTORS], of_hub = border->used.at[OF_HUB];
    const D *a = border->corner.at, *changes = roped->factors.at + factors * size;
    D z[n], *moved = border->moved.at;
    memset(z, 0, sizeof z);
    for (I k = 0; k < of_hub; k++)
        z[k] = x[unknowns + k] - product(border->hub.at + k * unknowns, x, unknowns);
    if (factors > 0) move_paths(&system->paths, &system->mesh, &system->arms, x, 1, moved);
    for (I k = 0; k < factors; k++) z[of_hub + k] = -product(changes + k * size, moved, size);
    for (I k = 0; k < n; k++) {
        I best = border->pivots.at[k];
        D own = z[best];
        z[best] = z[k], z[k] = own;
    }
    for (I k = 0; k < n; k++)
        for (I i = k + 1; i < n; i++) z[i] -= a[i * n + k] * z[k];
    for (I k = n - 1; k >= 0; k--) {
        z[k] /= a[k * n + k];
        for (I i = 0; i < k; i++) z[i] -= a[i * n + k] * z[k];
    }
    for (I u = 0; u < unknowns; u++) x[u] -= product(border->columns.at + u * n, z, n);
    for (I k = 0; k < of_hub; k++) x[unknowns + k] = z[k];
}

/* What ringsim.frame.elimination counts with, too. */
I constant_of_fronts(I number) { return (const I[]){PANEL, WIDE, EIGHT}[number]; }
