/* The balance of forces in a state, and its derivative, but for cables; pairs of bodies and slides. */

#include "core.h"

/* Rates and accelerations of now from its places and where the step has started. */
static void follow(const Coefficients *with, D step, const Followed *start, const Followed *now) {
    D beta = with->beta, gamma = with->gamma, alpha_m = with->alpha_m, alpha_f = with->alpha_f;
    for (I k = 0; k < now->place.n; k++) {
        D b0 = start->auxiliary.at[k], rate = start->rate.at[k];
        D moved = now->place.at[k] - start->place.at[k] - step * rate;
        D b1 = moved / (beta * step * step) - (0.5 / beta - 1.0) * b0;
        now->auxiliary.at[k] = b1;
        now->rate.at[k] = rate + step * ((1.0 - gamma) * b0 + gamma * b1);
        D pulled = (1.0 - alpha_m) * b1 + alpha_m * b0 - alpha_f * start->acceleration.at[k];
        now->acceleration.at[k] = pulled / (1.0 - alpha_f);
    }
}

/* Places of all followed coordinates at a pose, and arms of the cables' points. */
void put_in_place(const Mesh *mesh, const PathPoints *paths, const Held *held, const Pose *pose,
                  const D *hub, I n_hub, const Arms *arms, D *place, I n_place) {
    (void)n_hub, (void)n_place;
    const I *cuts = held->cuts.at;
    place_points(mesh, pose, place + cuts[POINTS], 0);
    place_paths(paths, pose, arms, place + cuts[PATHS]);
    memcpy(place + cuts[ANGLES], pose->angle.at, (size_t)pose->angle.n * sizeof(D));
    for (I n = 0; n < held->ends.n; n++)
        store_vector(place + cuts[ENDS] + 3 * n, place_of(pose, held->ends.at[n]));
    if (cuts[HUNG] > cuts[HUB]) store_vector(place + cuts[HUB], vector(hub));
    for (I n = 0; n < held->hung.n; n++)
        store_vector(place + cuts[HUNG] + 3 * n, place_of(pose, held->hung.at[n]));
}

/* Laws between bodies, and from bodies to the hub of a net. */

/* Change of stretch (m) and its rate (m/s) by which the slopes of the law are measured. */
static const D NUDGE = 1e-7;
/* Rows of the laws' tape. */
enum { STRETCH, RATE, ELASTIC, DAMPING, STORED };

/* Lengths (m), their rates (m/s) and directions of all pairs, from the first end to the second. */
static void stretched(const Web *web, const Held *held, const Followed *now, D *lengths, D *along,
                      D *units) {
    const I *cuts = held->cuts.at;
    const D *ends = now->place.at + cuts[ENDS], *rates = now->rate.at + cuts[ENDS];
    const D *hub = now->place.at + cuts[HUB], *hub_rate = now->rate.at + cuts[HUB];
    for (I k = 0; k < web->first.n; k++) {
        I one = web->first.at[k], other = web->second.at[k];
        Vec start = vector(one >= 0 ? ends + 3 * one : hub);
        Vec moving = vector(one >= 0 ? rates + 3 * one : hub_rate);
        Vec arm = minus(vector(ends + 3 * other), start);
        D length = sqrt(dot(arm, arm));
        Vec unit = times(1.0 / length, arm);
        lengths[k] = length, along[k] = dot(unit, minus(vector(rates + 3 * other), moving));
        store_vector(units + 3 * k, unit);
    }
}

/* Play the laws at lengths and rates, all so much larger. */
static void feel(const Web *web, const D *lengths, const D *along, D more, D faster) {
    D *stretch = row_of(&web->tape, STRETCH), *rate = row_of(&web->tape, RATE);
    for (I k = 0; k < web->first.n; k++) {
        stretch[k] = lengths[k] - web->natural.at[k] + more;
        rate[k] = along[k] + faster;
    }
    play(&web->tape);
}

static D force_of(const Web *web, I k) {
    return row_of(&web->tape, ELASTIC)[k] + row_of(&web->tape, DAMPING)[k];
}

/* Dissipating forces of the pairs (N), their lengths and rates; returns the energy stored, J. */
D passing_pairs(const Web *web, const Held *held, const Followed *now, D *lost, D *lengths, D *along) {
    D stored = 0.0, units[3 * web->first.n + 3];
    stretched(web, held, now, lengths, along, units);
    feel(web, lengths, along, 0.0, 0.0);
    for (I k = 0; k < web->first.n; k++) {
        lost[k] = row_of(&web->tape, DAMPING)[k];
        stored += row_of(&web->tape, STORED)[k];
    }
    return stored;
}

/* What pairs tell of a state: measured once for forces and once for their changes. */
#define MEASURED(web, held, now)                                                                   \
    I pairs = web->first.n;                                                                        \
    D lengths[pairs + 1], along[pairs + 1], units[3 * pairs + 3];                                  \
    stretched(web, held, now, lengths, along, units)

/* Add what resists at the bodies and, in the last three unknowns, at the hub; returns whether a
   string pulls at the hub. */
static bool pull_pairs(const Web *web, const Mesh *mesh, const Held *held, const Followed *now, D *g,
                       I size) {
    MEASURED(web, held, now);
    bool strung = false;
    feel(web, lengths, along, 0.0, 0.0);
    for (I n = 0; n < pairs; n++) {
        D pull = force_of(web, n);
        I one = web->first.at[n];
        if (pull == 0.0) continue;
        strung |= one < 0;
        Vec force = times(pull, vector(units + 3 * n));
        add_vector(g + mesh->home.at[web->ends.at[web->second.at[n]]], force);
        add_vector(g + (one >= 0 ? mesh->home.at[web->ends.at[one]] : size - 3), times(-1.0, force));
    }
    return strung;
}

/* Add derivatives of the pulls to the fronts and, if the hub is strung, those after its place to the
   first three columns, of so many, and to rows and corner of the border. */
static void add_pairs(const Web *web, const Mesh *mesh, const Held *held, const Followed *now,
                      D by_rate, bool strung, const Fronts *fronts, const Border *border, I wide) {
    D *columns = border->columns.at, *rows = border->hub.at, *corner = border->corner.at;
    MEASURED(web, held, now);
    D slope[pairs + 1];
    memset(slope, 0, sizeof slope);
    for (int side = 1; side >= -1; side -= 2)
        for (int what = 0; what < 2; what++) {
            feel(web, lengths, along, (1 - what) * side * NUDGE, what * side * NUDGE);
            D share = side / (2.0 * NUDGE) * (what == 0 ? 1.0 : by_rate);
            for (I n = 0; n < pairs; n++) slope[n] += share * force_of(web, n);
        }
    feel(web, lengths, along, 0.0, 0.0);
    for (I n = 0; n < pairs; n++) {
        bool loose = web->first.at[n] < 0;
        if (loose && !strung) continue;
        const I *spots = web->spots.at + 3 * n;
        D across = force_of(web, n) / lengths[n], *front = front_of(fronts, spots[0]);
        I home = mesh->home.at[web->ends.at[web->second.at[n]]], first = spots[1], second = spots[2];
        for (I i = 0; i < 3; i++)
            for (I j = 0; j < 3; j++) {
                D block = (slope[n] - across) * units[3 * n + i] * units[3 * n + j];
                if (i == j) block += across;
                front[(second + i) * fronts->columns + second + j] += block;
                if (loose) {
                    columns[(home + i) * wide + j] -= block;
                    rows[j * mesh->unknowns + home + i] -= block;
                    corner[i * wide + j] += block;
                } else {
                    front[(first + i) * fronts->columns + first + j] += block;
                    front[(first + i) * fronts->columns + second + j] -= block;
                    front[(second + i) * fronts->columns + first + j] -= block;
                }
            }
    }
}

/* Slides. */

enum { MOST_GAPS = 5 };

/* Gaps along x and y of a body's axes, and how they change, shapes (2,) and (2, 12); with turns about
   its axes times a reach (m) behind them, (5,) and (5, 12), if it is above 0.  Returns their number. */
static I aside(const Pose *pose, I top, I low, D reach, D *gaps, D *rows) {
    I size = reach > 0.0 ? MOST_GAPS : 2;
    Vec apart = minus(place_of(pose, low), place_of(pose, top));
    Mat axes = axes_of(pose, top), others = axes_of(pose, low);
    memset(rows, 0, (size_t)(12 * size) * sizeof(D));
    for (int k = 0; k < 2; k++) {
        Vec axis = {axes.a[k], axes.a[3 + k], axes.a[6 + k]};
        D *row = rows + 12 * k;
        gaps[k] = dot(axis, apart);
        store_vector(row, times(-1.0, axis));
        store_vector(row + 3, cross(axis, apart));
        store_vector(row + 6, axis);
    }
    for (int k = 0; k < size - 2; k++) {
        int first = (k + 1) % 3, second = (k + 2) % 3;
        D sine = 0.0, *row = rows + 12 * (2 + k);
        for (int i = 0; i < 3; i++) {
            sine += axes.a[3 * i + second] * others.a[3 * i + first];
            sine -= axes.a[3 * i + first] * others.a[3 * i + second];
            row[3 + i] = -reach * axes.a[3 * i + k], row[9 + i] = reach * axes.a[3 * i + k];
        }
        gaps[2 + k] = 0.5 * reach * sine;
    }
    return size;
}

/* Size of all gaps of a slide, m. */
D slid_apart(const Held *held, const Pose *pose, I n) {
    D gaps[MOST_GAPS], rows[12 * MOST_GAPS], sum = 0.0;
    I size = aside(pose, held->top.at[n], held->low.at[n], held->reach.at[n], gaps, rows);
    for (I k = 0; k < size; k++) sum += gaps[k] * gaps[k];
    return sqrt(sum);
}

static void hold_slides(const Mesh *mesh, const Held *held, const Pose *pose, D *g) {
    for (I n = 0; n < held->top.n; n++) {
        I top = held->top.at[n], low = held->low.at[n];
        D gaps[MOST_GAPS], rows[12 * MOST_GAPS];
        I size = aside(pose, top, low, held->reach.at[n], gaps, rows);
        for (I k = 0; k < size; k++) {
            D force = held->stiffness * gaps[k];
            for (int i = 0; i < 6; i++) {
                g[mesh->home.at[top] + i] += force * rows[12 * k + i];
                g[mesh->home.at[low] + i] += force * rows[12 * k + 6 + i];
            }
        }
    }
}

/* Gaps are so small that how their directions turn does not matter. */
static void add_slides(const Mesh *mesh, const Held *held, const Pose *pose, const Fronts *fronts) {
    for (I n = 0; n < held->top.n; n++) {
        const I *top = mesh->frame_local.at + 2 * held->top.at[n];
        const I *low = mesh->frame_local.at + 2 * held->low.at[n];
        D gaps[MOST_GAPS], rows[12 * MOST_GAPS], *front = front_of(fronts, top[0]);
        I size = aside(pose, held->top.at[n], held->low.at[n], held->reach.at[n], gaps, rows);
        for (I i = 0; i < 12; i++)
            for (I j = 0; j < 12; j++) {
                I row = i < 6 ? top[1] + i : low[1] + i - 6, column = j < 6 ? top[1] + j : low[1] + j - 6;
                D shared = 0.0;
                for (I k = 0; k < size; k++) shared += rows[12 * k + i] * rows[12 * k + j];
                front[row * fronts->columns + column] += held->stiffness * shared;
            }
    }
}

/* All of it. */

/* Accelerations of the points with mass, less that of gravity. */
static const D *inertial(const Held *held, const Followed *now, I points, D *room) {
    const D *own = now->acceleration.at + held->cuts.at[POINTS];
    if (!held->weighs) return own;
    for (I n = 0; n < points; n++)
        for (int i = 0; i < 3; i++) room[3 * n + i] = own[3 * n + i] - held->gravity.at[i];
    return room;
}

/* Follow a pose over a step, and add forces of rods, masses, slides, joints and strings to the
   residual of all so many unknowns; returns whether a string pulls.  loads keep what elements hold. */
bool balance(const Mesh *mesh, const PathPoints *paths, const Held *held, const Acting *joints,
             const Web *web, const Coefficients *coefficients, D step, const Followed *start,
             const Pose *pose, const D *hub, const Arms *arms, const Followed *now,
             const Strains *strains, D *loads, D *g, I size) {
    const I *cuts = held->cuts.at;
    I points = mesh->point_mass.n;
    D room[3 * points + 1];
    put_in_place(mesh, paths, held, pose, hub, 0, arms, now->place.at, 0);
    follow(coefficients, step, start, now);
    add_forces(mesh, pose, now->place.at + cuts[POINTS], 0, inertial(held, now, points, room), 0,
               strains, loads, 0, g, 0);
    const D *rates = now->rate.at + cuts[ANGLES];
    for (I n = 0; n < held->damping.n; n++)
        g[mesh->angle_home.at[n]] += held->damping.at[n] * rates[n];
    push_joints(joints, pose->angle.at, rates, mesh, g);
    hold_slides(mesh, held, pose, g);
    if (web->first.n == 0) return false;
    if (cuts[HUNG] > cuts[HUB])
        for (int i = 0; i < 3; i++)
            g[size - 3 + i] += web->hub_mass * (now->acceleration.at[cuts[HUB] + i] - held->gravity.at[i]);
    return pull_pairs(web, mesh, held, now, g, size);
}

/* Set the fronts, and the part of strings, if one pulls, in a border of so many columns, to the
   derivative of the last balance; lead, by_rate and by_place are those of rates of strains after
   strains, and of rates and accelerations after places. */
void differentiate(const Mesh *mesh, const Held *held, const Acting *joints, const Web *web,
                   const Pose *pose, const Followed *now, const D *loads, D lead, D by_rate,
                   D by_place, bool strung, const Fronts *fronts, const Border *border, I wide) {
    const I *cuts = held->cuts.at;
    I points = mesh->point_mass.n;
    D room[3 * points + 1];
    begin_tangent(mesh, pose, now->place.at + cuts[POINTS], 0, inertial(held, now, points, room), 0,
                  loads, 0, lead, by_place, fronts);
    add_slides(mesh, held, pose, fronts);
    for (I n = 0; n < held->damping.n; n++) {
        const I *local = mesh->angle_local.at + 2 * n;
        front_of(fronts, local[0])[local[1] * (fronts->columns + 1)] += held->damping.at[n] * by_rate;
    }
    add_joint_slopes(joints, pose->angle.at, now->rate.at + cuts[ANGLES], by_rate, mesh, fronts);
    if (strung)
        for (int i = 0; i < 3; i++) border->corner.at[i * (wide + 1)] = web->hub_mass * by_place;
    if (web->first.n > 0)
        add_pairs(web, mesh, held, now, by_rate, strung, fronts, border, wide);
}
