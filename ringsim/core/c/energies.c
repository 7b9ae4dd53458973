/* Energies of a state, and what friction, dampers and stops take from one state to the next. */

#include "core.h"

/* What is told of a state: its energies, that of rods and slides alone, what was lost since the other
   state (J), and the largest distance of a body from the boom that it slides along (m). */
enum { KINETIC, ELASTIC, STRAINED, LOST, APART };

/* What takes energy: forces, and behind them the places that they resist and their rates, of all
   lines that carry bodies (which Python has written), joint angles, pairs, and strains of rods. */
typedef struct {
    D *forces, *places, *rates;
} Passing;

/* As if forces F and rates v went linearly between two states, of so many:

       mean force times displacement + h (F2 - F1) (v2 - v1) / 12

   (ringsim.stepping.instant.lost_between). */
static D lost_between(const D *before, const D *after, I n, D step) {
    V work = all(0.0), bend = all(0.0);
    D left = 0.0;
    I k = 0;
    for (; k + LANES <= n; k += LANES) {
        V one = take(before + k), two = take(after + k);
        work += (one + two) * (take(after + n + k) - take(before + n + k));
        bend += (two - one) * (take(after + 2 * n + k) - take(before + 2 * n + k));
    }
    for (; k < n; k++) {
        D one = before[k], two = after[k];
        left += 0.5 * (one + two) * (after[n + k] - before[n + k]);
        left += step / 12.0 * (two - one) * (after[2 * n + k] - before[2 * n + k]);
    }
    work = all(0.5) * work + all(step / 12.0) * bend;
    return (work[0] + work[2]) + (work[1] + work[3]) + left;
}

/* Read a state: what takes energy there, shape (3, n), and what is told of it.  Kept is the same of
   the state so long before, or empty. */
void read_energies(const System *system, const Moving *now, D step, D *passing, I n_passing, const D *kept, I n_kept, D *told, I n_told) {
    (void)n_told;
    const Mesh *mesh = &system->mesh;
    const Held *held = &system->held;
    const Web *web = &system->web;
    const Strains *strains = &now->strains;
    const I *cuts = held->cuts.at;
    const D *rate = now->followed.rate.at;
    const D *angles = now->pose.angle.at, *turning = rate + cuts[ANGLES];
    I each = n_passing / 3, first = 3 * held->hung.n, count = now->pose.angle.n;
    Passing own = {passing + first, passing + each + first, passing + 2 * each + first};

    energies_of(mesh, rate + cuts[POINTS], 0, strains->now.at, 0, told, 0);
    told[STRAINED] = told[ELASTIC], told[APART] = 0.0;
    for (I n = 0; n < held->top.n; n++) {
        D apart = slid_apart(held, &now->pose, n);
        told[STRAINED] += 0.5 * held->stiffness * apart * apart;
        told[APART] = larger(told[APART], apart);
    }
    told[ELASTIC] = told[STRAINED];

    for (I k = 0; k < count; k++) {
        own.forces[k] = held->damping.at[k] * turning[k];
        own.places[k] = angles[k], own.rates[k] = turning[k];
    }
    told[ELASTIC] += passing_joints(&system->joints, angles, turning, own.forces);
    if (web->first.n > 0)
        told[ELASTIC] += passing_pairs(web, held, &now->followed, own.forces + count,
                                       own.places + count, own.rates + count);
    if (cuts[HUNG] > cuts[HUB]) {
        Vec moving = vector(rate + cuts[HUB]);
        told[KINETIC] += 0.5 * web->hub_mass * dot(moving, moving);
    }

    D lead = strains->lead.at[0];
    I before = first + count + web->first.n;
    for (I k = 0; k < each - before; k++) {
        D straining = lead * strains->now.at[k] + strains->before.at[k];
        passing[before + k] = mesh->tau.at[k / 6] * mesh->stiffness.at[k] * straining;
        passing[each + before + k] = strains->now.at[k];
        passing[2 * each + before + k] = straining;
    }
    told[LOST] = n_kept > 0 ? lost_between(kept, passing, each, step) : 0.0;
}

/* Two rows of a chain: works (J) from one to the other, put in by the winches less what is wound up,
   and lost; see ringsim.core.chain.work_between. */
void work_of_ropes(const RopeTable *ropes, const D *before, I n_before, const D *after, I n_after,
                   D *out, I n_out) {
    (void)n_before, (void)n_after, (void)n_out;
    const I *behind = ropes->behind.at;
    I pulleys = ropes->behind.n;
    I count = ropes->starts.n, n = ropes->near.n, forces = 7 * n + 4 * pulleys, held = forces + pulleys;
    I natural = held + pulleys, strains = natural + 4 * count, viscous = natural + 8 * count;
    I density = viscous + count, wound = density + count, j = 0;
    Place place = {-1, false, false};
    D driven = 0.0, lost = 0.0;
    for (I rope = 0; rope < count; rope++) {
        I first = ropes->starts.at[rope], last = ropes->ends.at[rope] - 1;
        place = place_behind(ropes, rope, place);
        const D *turned = after + wound + 2 * place.cable, *had = before + wound + 2 * place.cable;
        D near = place.begins ? turned[0] - had[0] : 0.0, far = place.ends ? turned[1] - had[1] : 0.0;
        D one = before[strains + rope], two = after[strains + rope];
        driven += (before[2 * n + first] * (1.0 + one) + after[2 * n + first] * (1.0 + two)) * near;
        driven += (before[2 * n + last] * (1.0 + one) + after[2 * n + last] * (1.0 + two)) * far;
        driven -= (before[density + rope] + after[density + rope]) * (near + far);
        D mean = 0.5 * (before[natural + rope] + after[natural + rope]);
        lost += (before[viscous + rope] + after[viscous + rope]) * mean * (two - one);
        /* A jammed pulley belongs to the rope behind it. */
        for (; j < pulleys && behind[j] <= last; j++)
            lost += (before[forces + j] + after[forces + j]) * (before[held + j] - after[held + j] - far);
    }
    out[0] = 0.5 * driven, out[1] = 0.5 * lost;
}
