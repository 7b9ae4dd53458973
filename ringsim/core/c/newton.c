/* Newton's method with secants in one step: forces out of balance, their derivative, and the change
   that follows. */

#include "core.h"

/* Iterations a step at most. */
enum { MOST = 25 };
/* Ratio of successive residuals above which the tangent is renewed: a tangent costs two iterations,
   and secants teach the old one. */
static const D FALL = 0.3;
/* Largest share of the last change in the next one for which a secant is taken: a change that hardly
   differs from the last one says that the tangent is wrong there. */
static const D ALIKE = 0.7;

/* What there is beside the tables: winches that answer to their ropes, forces of parts. */
enum { WINCHES = 1, PARTS = 2 };

I most_iterations(void) { return MOST; }

static D weighted(const D *weights, const D *a, const D *b, I n) {
    V low = all(0.0), high = all(0.0);
    I k = 0;
    for (; k + 2 * LANES <= n; k += 2 * LANES) {
        low += take(weights + k) * take(a + k) * take(b + k);
        high += take(weights + k + LANES) * take(a + k + LANES) * take(b + k + LANES);
    }
    low += high;
    D sum = (low[0] + low[2]) + (low[1] + low[3]);
    for (; k < n; k++) sum += weights[k] * a[k] * b[k];
    return sum;
}

/* Let winches answer to ropes whose spans are measured. */
I answer_ropes(const Roped *roped, Ask ask) {
    const RopeTable *ropes = &roped->ropes;
    const Answering *winches = &roped->winches;
    const D *turned = winches->turned.at;
    find_paths(ropes, &roped->spans, winches->paths.at);
    I how = turn_winches(winches, ropes, ask);
    if (how == BALANCED) wind(ropes, turned, 0, turned + 2 * winches->on.n, 0, &roped->drums);
    return how;
}

/* Forces out of balance on all unknowns, into system->g. */
I unbalance(const System *system, const Roped *roped, I asks, Ask ask, D step, const Moving *start,
            const Moving *now) {
    const Mesh *mesh = &system->mesh;
    const I *cuts = system->held.cuts.at;
    const D *rates = now->followed.rate.at;
    D *g = system->g.at;
    I size = system->g.n;
    for (I k = 0; k < size; k++) g[k] = -system->loads.at[k];
    roped->border.used.at[STRUNG] =
        balance(mesh, &system->paths, &system->held, &system->joints, &system->web, &system->with,
                step, &start->followed, &now->pose, now->hub.at, &system->arms, &now->followed,
                &now->strains, system->kept.at, g, size);
    note_joints(&system->joints, &system->rubbing, rates + cuts[ANGLES]);
    if (asks & PARTS && !answered(ask, FORCES)) return RAISED;
    if (roped->ropes.starts.n > 0) {
        const D *places = now->followed.place.at + cuts[PATHS];
        rates += cuts[PATHS];
        if (asks & WINCHES) {
            measure(&roped->ropes, places, 0, rates, 0, &roped->spans);
            I how = answer_ropes(roped, ask);
            if (how != BALANCED) return how;
        }
        D least = pull_cables(system, roped, places, rates, g);
        for (I r = 0; r < roped->drums.natural.n; r++)
            if (!(roped->drums.natural.at[r] > 0.0)) return ROPES;
        if (!(least > SHORTEST)) return ROPES; /* none without an answer */
        note_rates(&roped->seen, roped->spans.speed.at, roped->spans.speed.n);
        note_forces(roped);
    }
    for (I k = 0; k < mesh->fixed.n; k++) {
        system->reaction.at[k] = g[mesh->fixed.at[k]];
        g[mesh->fixed.at[k]] = 0.0;
    }
    return BALANCED;
}

/* The derivative of the last residual after the unknowns, factored.

       K x + C z = r,   R^T x + D z = r_z:

   K is in the fronts; z are the changes of tension in all ropes and, where a net's strings pull, the
   places of its hub. */
I stiffen(const System *system, const Roped *roped, I asks, Ask ask, D step, const Moving *now) {
    const Mesh *mesh = &system->mesh;
    const Border *border = &roped->border;
    const Coefficients *with = &system->with;
    const I *cuts = system->held.cuts.at;
    const D *rates = now->followed.rate.at;
    /* As Coefficients in ringsim.frame.state, which tells parts of Python's the same. */
    D by_rate = with->gamma / (with->beta * step);
    D by_place = (1.0 - with->alpha_m) / ((1.0 - with->alpha_f) * with->beta * step * step);
    I strung = border->used.at[STRUNG], factors = 0;
    if (roped->ropes.starts.n > 0) {
        if (asks & WINCHES) {
            I how = find_left(&roped->winches, &roped->ropes, ask, roped->left.at, roped->left.n);
            if (how != BALANCED) return how;
        }
        factors = find_slopes(roped, &system->laws);
    }
    I wide = (factors + 3 * strung + 7) / 8 * 8;
    border->used.at[WIDE_USED] = wide, border->used.at[FACTORS] = factors;
    border->used.at[OF_HUB] = 3 * strung;
    border->alone.at[0] = system->hub && !strung ? system->web.hub_mass * by_place : NAN;
    memset(border->columns.at, 0, (size_t)(mesh->unknowns * wide) * sizeof(D));
    if (strung) memset(border->hub.at, 0, (size_t)(3 * mesh->unknowns) * sizeof(D));
    memset(border->corner.at, 0, (size_t)(wide * wide) * sizeof(D));
    for (I k = 0; k < wide; k++) border->corner.at[k * (wide + 1)] = -1.0;
    differentiate(mesh, &system->held, &system->joints, &system->web, &now->pose, &now->followed,
                  system->kept.at, now->strains.lead.at[0], by_rate, by_place, strung, &system->fronts,
                  border, wide);
    add_dry_slopes(&system->joints, &system->rubbing, now->pose.angle.at, rates + cuts[ANGLES],
                   by_rate, mesh, &system->fronts);
    if (asks & PARTS && !answered(ask, SLOPES)) return RAISED;
    if (roped->ropes.starts.n > 0)
        add_cables(system, roped, rates + cuts[PATHS], by_rate, factors, wide, 3 * strung);
    if (!factor(mesh, &system->fronts)) return PIVOT;
    return wide == 0 || close_border(system, roped) ? BALANCED : PIVOT;
}

/* Replace what is out of balance by the change of all unknowns, the hub's last, that takes it to
   zero. */
void relax(const System *system, const Roped *roped, D *x, I size) {
    const Border *border = &roped->border;
    I unknowns = system->mesh.unknowns;
    for (I k = 0; k < size; k++) x[k] = -x[k];
    solve_one(&system->mesh, &system->fronts, x, unknowns);
    if (border->used.at[WIDE_USED] > 0) cross_border(system, roped, x);
    if (!isnan(border->alone.at[0]))
        for (I k = unknowns; k < size; k++) x[k] /= border->alone.at[0];
}

/* Broyden's method: what a tangent that is not renewed learns from the changes made with it.

   With changes s_0 ... s_n since the tangent was factored, and z = -K^-1 g of the newest residual,

       z <- z + s_(j+1) (s_j . z) / (s_j . s_j),  j = 0 ... n - 1,
       s_(n+1) = z / (1 - (s_n . z) / (s_n . s_n))

   (the product form of the good Broyden update: Kelley, Iterative Methods for Linear and Nonlinear
   Equations, SIAM 1995, section 7.3).  It costs some dot products, in which turns count by the way
   that they move a length: sums of metres and radians would depend on the unit of length.

   Changes has room for all of a step behind each other, and their squares; so many are made. */
void learn(const D *weights, I n, D *changes, I n_changes, D *squares, I n_squares, I made, D *x,
           I n_x) {
    (void)n_changes, (void)n_squares, (void)n_x;
    for (I j = 0; j < made; j++) {
        D share = weighted(weights, changes + j * n, x, n) / squares[j];
        if (j < made - 1)
            for (I k = 0; k < n; k++) x[k] += share * changes[(j + 1) * n + k];
        else if (share < ALIKE)
            for (I k = 0; k < n; k++) x[k] /= 1.0 - share;
    }
    memcpy(changes + made * n, x, (size_t)n * sizeof(D));
    squares[made] = weighted(weights, x, x, n);
}

/* Bring a state into balance, in place.  Told are the iterations, the tangents and the last residual
   norm (N).

   Changes are taken whole.  Where forces bend sharply, as of stops and of dry friction that turns
   round, the residual may grow for an iteration: what it finds there is what tells the way back
   (turning.c), and shorter changes would only find it later. */
I balance_step(const System *system, const Roped *roped, I asks, Ask ask, D step, const Moving *start,
               const Moving *now, D tolerance, D *told, I n_told) {
    (void)n_told;
    I size = system->g.n, unknowns = system->mesh.unknowns, made = 0;
    const D *lengths = system->lengths.at;
    D *g = system->g.at, last = INFINITY, squares[MOST];
    told[0] = told[1] = told[2] = 0.0;
    for (I taken = 0; taken < MOST; taken++) {
        I how = unbalance(system, roped, asks, ask, step, start, now);
        if (how != BALANCED) return how;
        D sum = 0.0;
        for (I k = 0; k < size; k++) sum += (g[k] / lengths[k]) * (g[k] / lengths[k]);
        D norm = told[2] = sqrt(sum);
        if (!isfinite(norm)) return ENDLESS;
        if (norm <= tolerance) return BALANCED;
        told[0] += 1.0;
        if (taken == 0 || norm > FALL * last) {
            told[1] += 1.0, made = 0;
            how = stiffen(system, roped, asks, ask, step, now);
            if (how != BALANCED) return how;
        }
        last = norm;
        relax(system, roped, g, size);
        learn(system->weights.at, size, system->changes.at, 0, squares, 0, made++, g, size);
        move(&system->mesh, &now->pose, g, unknowns);
        for (I k = unknowns; k < size; k++) now->hub.at[k - unknowns] += g[k];
    }
    return UNBALANCED;
}
