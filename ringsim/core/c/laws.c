/* Laws as recorded operations, and what they do to joint angles; see ringsim/frame/laws.py. */

#include "core.h"

/* In the order of ringsim.frame.laws._KNOWN. */
enum {
    ADD, SUBTRACT, MULTIPLY, DIVIDE, MAXIMUM, MINIMUM, NEGATIVE, ABSOLUTE, SIGN, SQRT, SQUARE,
    POWER, EXP, LOG, SIN, COS, TANH, ARCTANH, GREATER, LESS, GREATER_EQUAL, LESS_EQUAL, ARCTAN,
    EXPM1, LOG1P, POSITIVE, WHERE
};

#define EACH(expression)                                                                           \
    for (I k = 0; k < n; k++) out[k] = (expression);                                               \
    break

static void one(I kind, I n, const D *x, const D *y, const D *z, D *out) {
    switch (kind) {
    case ADD: EACH(x[k] + y[k]);
    case SUBTRACT: EACH(x[k] - y[k]);
    case MULTIPLY: EACH(x[k] * y[k]);
    case DIVIDE: EACH(x[k] / y[k]);
    /* A number that is none stays none, as numpy has it. */
    case MAXIMUM: EACH(x[k] >= y[k] || x[k] != x[k] ? x[k] : y[k]);
    case MINIMUM: EACH(x[k] <= y[k] || x[k] != x[k] ? x[k] : y[k]);
    case NEGATIVE: EACH(-x[k]);
    case POSITIVE: EACH(x[k]);
    case WHERE: EACH(x[k] != 0.0 ? y[k] : z[k]);
    case ABSOLUTE: EACH(fabs(x[k]));
    case SIGN: EACH(x[k] > 0.0 ? 1.0 : x[k] < 0.0 ? -1.0 : x[k] == 0.0 ? 0.0 : x[k]);
    case SQRT: EACH(sqrt(x[k]));
    case SQUARE: EACH(x[k] * x[k]);
    case POWER: EACH(y[k] == 2.0 ? x[k] * x[k] : pow(x[k], y[k]));
    case EXP: EACH(exp(x[k]));
    case LOG: EACH(log(x[k]));
    case SIN: EACH(sin(x[k]));
    case COS: EACH(cos(x[k]));
    case TANH: EACH(tanh(x[k]));
    case ARCTANH: EACH(atanh(x[k]));
    case ARCTAN: EACH(atan(x[k]));
    case EXPM1: EACH(expm1(x[k]));
    case LOG1P: EACH(log1p(x[k]));
    case GREATER: EACH(x[k] > y[k] ? 1.0 : 0.0);
    case GREATER_EQUAL: EACH(x[k] >= y[k] ? 1.0 : 0.0);
    case LESS: EACH(x[k] < y[k] ? 1.0 : 0.0);
    case LESS_EQUAL: EACH(x[k] <= y[k] ? 1.0 : 0.0);
    }
}

/* Compute the results from the inputs. */
void play(const Tape *tape) {
    for (I law = 0; law < tape->laws.n; law++) {
        const I *own = tape->laws.at + 4 * law;
        for (I n = own[0]; n < own[1]; n++) {
            const I *code = tape->code.at + 5 * n;
            one(code[0], own[3] - own[2], row_of(tape, code[2]) + own[2],
                row_of(tape, code[3]) + own[2], row_of(tape, code[4]) + own[2],
                row_of(tape, code[1]) + own[2]);
        }
    }
}

/* Torques on joint angles: friction, stops and joints that stick. */

/* Change of angle (rad) and rate (rad/s) by which the slopes of laws are measured. */
static const D NUDGE = 1e-7;
/* Rows of the tape: coordinate and rate, whether the law acts, its setting; its reaction. */
enum { TURNED, RATE, ON, SETTING, ELASTIC, DAMPING, STORED };

/* Play the laws at angles and rates, with all coordinates and rates so much larger. */
static void feel(const Acting *acting, const D *angles, const D *rates, D more, D faster) {
    D *turned_by = row_of(&acting->tape, TURNED), *rate = row_of(&acting->tape, RATE);
    for (I n = 0; n < acting->own.n; n++) {
        I k = acting->own.at[n];
        turned_by[n] = acting->sense.at[n] * angles[k] + more;
        rate[n] = acting->sense.at[n] * rates[k] + faster;
    }
    play(&acting->tape);
}

void push_joints(const Acting *acting, const D *angles, const D *rates, const Mesh *mesh, D *g) {
    feel(acting, angles, rates, 0.0, 0.0);
    const D *elastic = row_of(&acting->tape, ELASTIC), *damping = row_of(&acting->tape, DAMPING);
    for (I n = 0; n < acting->own.n; n++)
        g[mesh->angle_home.at[acting->own.at[n]]] += acting->sense.at[n] * (elastic[n] + damping[n]);
}

/* Derivatives after the angles, by central differences; by_rate is that of rates, 1/s. */
void add_joint_slopes(const Acting *acting, const D *angles, const D *rates, D by_rate,
                      const Mesh *mesh, const Fronts *fronts) {
    I count = acting->soft;
    D slopes[2][count + 1];
    memset(slopes, 0, sizeof slopes);
    const D *elastic = row_of(&acting->tape, ELASTIC), *damping = row_of(&acting->tape, DAMPING);
    for (int side = 1; side >= -1; side -= 2)
        for (int what = 0; what < 2; what++) {
            feel(acting, angles, rates, (1 - what) * side * NUDGE, what * side * NUDGE);
            for (I k = 0; k < count; k++) slopes[what][k] += side * (elastic[k] + damping[k]);
        }
    for (I k = 0; k < count; k++) {
        const I *local = mesh->angle_local.at + 2 * acting->own.at[k];
        D whole = slopes[0][k] + by_rate * slopes[1][k];
        front_of(fronts, local[0])[local[1] * (fronts->columns + 1)] += whole / (2.0 * NUDGE);
    }
}

/* Dry friction: laws behind the soft ones. */

static I dry(const Acting *acting) { return acting->own.n - acting->soft; }

static D rate_of(const Acting *acting, const D *rates, I k) {
    return acting->sense.at[acting->soft + k] * rates[acting->own.at[acting->soft + k]];
}

/* Remember an iterate's rates where joints rub dry. */
void note_joints(const Acting *acting, const Seen *rubbing, const D *rates) {
    I count = dry(acting);
    D own[count + 1];
    for (I k = 0; k < count; k++) own[k] = rate_of(acting, rates, k);
    note_rates(rubbing, own, count);
}

/* Torques of dry friction at rates of its own. */
static void rub(const Acting *acting, const D *at, D more, D *out) {
    I count = dry(acting);
    D *rate = row_of(&acting->tape, RATE) + acting->soft;
    for (I k = 0; k < count; k++) rate[k] = at[k] + more;
    play(&acting->tape);
    memcpy(out, row_of(&acting->tape, DAMPING) + acting->soft, (size_t)count * sizeof(D));
}

/* Add their derivatives, as far as Newton has seen both sides; see turning.c. */
void add_dry_slopes(const Acting *acting, const Seen *rubbing, const D *angles, const D *rates,
                    D by_rate, const Mesh *mesh, const Fronts *fronts) {
    I count = dry(acting);
    if (count <= 0) return;
    D at[count], across[count], here[count], there[count], ahead[count], behind[count];
    for (I k = 0; k < count; k++)
        at[k] = rate_of(acting, rates, k), across[k] = rate_across(rubbing, k);
    feel(acting, angles, rates, 0.0, 0.0);
    rub(acting, at, 0.0, here);
    rub(acting, across, 0.0, there);
    rub(acting, at, NUDGE, ahead);
    rub(acting, at, -NUDGE, behind);
    for (I k = 0; k < count; k++) {
        const I *local = mesh->angle_local.at + 2 * acting->own.at[acting->soft + k];
        D own = (ahead[k] - behind[k]) / (2.0 * NUDGE);
        front_of(fronts, local[0])[local[1] * (fronts->columns + 1)] +=
            by_rate * slope_between(rubbing, k, at[k], own, here[k], there[k]);
    }
}

/* Add torques that dissipate to those of all angles; returns the energy stored, J. */
D passing_joints(const Acting *acting, const D *angles, const D *rates, D *lost) {
    feel(acting, angles, rates, 0.0, 0.0);
    const D *damping = row_of(&acting->tape, DAMPING), *energy = row_of(&acting->tape, STORED);
    D stored = 0.0;
    for (I n = 0; n < acting->own.n; n++) {
        lost[acting->own.at[n]] += acting->sense.at[n] * damping[n];
        stored += energy[n];
    }
    return stored;
}
