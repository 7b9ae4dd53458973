/* Winches that answer to their ropes within a step; the equations stand in ringsim/core/winches.py. */

#include "core.h"

/* Change of path in m by which the answer of the winches to the structure is measured: a hundred
   million roundings of a path of 1 m, and still a force of 1e-3 N at EA = 1e5 N. */
static const D NUDGE = 1e-8;
/* Secants before it is searched between both sides: from the last answer three or four are enough. */
enum { SECANTS = 6 };
/* Tries in a row that left more than half of what they searched, before it is halved: steps and
   roundings lead lines astray. */
enum { ASTRAY = 2 };
/* Speeds (m/s, and relative) that are one: over a step of 0.1 s they wind 1e-14 m more or less, of
   which a rope of EA = 1e5 N takes no notice (1e-10 N). */
static const D SAME = 1e-15, ALIKE = 1e-11;

/* Places of told: what a law sees, and what it says. */
enum { TENSION, PATH_RATE, PATH_SLOPE, TIME, LAGGING, LAG, SAID };
/* What is asked of a winch: the speed that its law commands, or ln(eta) of all pulleys at the speeds
   that are foreseen. */
enum { COMMAND, DECAYS, QUESTIONS };

/* Places of balance: the speed of all winches of a rope, by how much the first is the faster one, and
   how fast the excess of either rose there. */
enum { TOTAL, TOTAL_GAIN, APART, APART_GAIN, BALANCE };

/* Times (s) for which a speed and its mean in the step before count, and these means of the rope
   wound and of the path given free, m/s. */
typedef struct {
    D own, past, wound, freed;
} Weights;

/* A rope with the winches that answer to it, where a step is tried. */
typedef struct {
    const Answering *own;
    const RopeTable *ropes;
    Ask ask;
    I rope, winches[2], count;
    Path path;
    D natural, rest, follow;
    Weights weights;
} Asked;

static D median(D a, D b, D c) { return fmax(fmin(a, b), fmin(fmax(a, b), c)); }

static Weights weights_of(const Answering *own, I rope) {
    const D *past = own->past.at + 3 * rope;
    D elapsed = own->elapsed.at[0], ratio = elapsed / past[0];
    if (past[0] == 0.0 || elapsed == 0.0) return (Weights){elapsed, 0.0, 0.0, 0.0};
    D behind = elapsed * ratio / (1.0 + 2.0 * ratio);
    return (Weights){elapsed - behind, behind, past[1] / past[0], past[2] / past[0]};
}

/* Rope (m) that all winches which answer have wound since the step began. */
static D wound_by(const Weights *weights, D total) {
    return weights->own * total + weights->past * median(0.0, weights->wound, 2.0 * total);
}

/* Rate (m/s) at which the structure gives path free for them, but for what other winches wind. */
static D takeup_of(const Asked *asked) {
    const D *began = asked->own->began.at + 2 * asked->rope;
    const Weights *with = &asked->weights;
    if (asked->own->elapsed.at[0] == 0.0) return -asked->path.rate - asked->rest;
    D freed = began[0] - asked->path.length - (began[1] - asked->natural);
    /* Where a structure stops, limited as wound_by: both then follow it without a jerk. */
    return median(freed / with->own, (freed - with->past * with->freed) / with->own,
                  freed / (with->own + 2.0 * with->past));
}

/* What the speed of a winch is compared with (m/s), and over what time (s), for its acceleration. */
static void lag(const Asked *asked, I winch, D *told) {
    const D *speeds = asked->own->speeds.at + 2 * winch;
    D elapsed = asked->own->elapsed.at[0], last = asked->own->past.at[3 * asked->rope];
    told[LAGGING] = speeds[0], told[LAG] = elapsed;
    if (last == 0.0 || elapsed == 0.0) return;
    D ratio = elapsed / last, share = 1.0 + 2.0 * ratio, more = 1.0 + ratio;
    D found = (more * more * speeds[0] - ratio * ratio * speeds[1]) / share;
    told[LAGGING] = median(0.0, found, 2.0 * speeds[0]), told[LAG] = elapsed * more / share;
}

/* Tensions at the winches that answer to a rope over its mean tension, were they to turn at these
   speeds (m/s) while the structure moves as at the beginning of the step; whether Python has
   answered. */
static bool ratios_at(const Asked *asked, const D *speeds, D *ratios) {
    const Answering *own = asked->own;
    const RopeTable *ropes = asked->ropes;
    I first = ropes->starts.at[asked->rope], last = ropes->ends.at[asked->rope];
    D path = own->began.at[2 * asked->rope], *logs = own->logs.at, most = 0.0, mean = 0.0;
    D beyond = 1.0, more[2] = {0.0, 0.0};
    for (I k = 0; k < asked->count; k++)
        more[asked->winches[k] % 2] = speeds[k] - own->speeds.at[2 * asked->winches[k]];
    for (I i = first + 1; i < last; i++) {
        I j = ropes->pulley.at[i];
        beyond -= own->lengths.at[i - 1] / path;
        own->seen.at[j] = own->sliding.at[j] + more[0] * beyond + more[1] * (beyond - 1.0);
    }
    if (own->moves && !answered(asked->ask, LAWS + QUESTIONS * asked->winches[0] + DECAYS)) return false;
    logs[first] = 0.0;
    for (I i = first + 1; i < last; i++) {
        I j = ropes->pulley.at[i];
        logs[i] = logs[i - 1] + own->decays.at[j] * tanh(own->seen.at[j] / ropes->slip_speed.at[j]);
        if (logs[i] > most) most = logs[i];
    }
    for (I i = first; i < last; i++) mean += exp(logs[i] - most) * own->lengths.at[i] / path;
    for (I k = 0; k < asked->count; k++) {
        D at = logs[asked->winches[k] % 2 ? last - 1 : first];
        ratios[k] = ropes->alive.at[asked->rope] * exp(at - most) / mean;
    }
    return true;
}

/* A search for the zero of what rises by at least its argument: where it is tried next, how fast it
   rises there, what it is on either side (0 if not known), and where it was tried before. */
typedef struct {
    D at, gain, low, high, below, above, from, before, left;
    I tries, astray;
} Search;

static Search search_from(D guess, D gain, D low, D high) {
    return (Search){.at = fmin(fmax(guess, low), high), .gain = gain, .low = low, .high = high,
                    .left = high - low};
}

/* Whether a search ends with what it has found at its place, of speeds of a size (m/s).

   By secants: an iteration or a step ago the answer was nearly the same.  Where bends lead these
   astray, by lines from side to side, and halves where these leave too much. */
static bool ends(Search *search, D over, D size) {
    D same = SAME + ALIKE * size, way = search->at - search->from;
    if (over > 0.0) search->high = search->at, search->above = over;
    else search->low = search->at, search->below = over;
    D left = search->high - search->low;
    if (fabs(over) <= same || left <= 2.0 * same) return true;
    if (search->tries && way != 0.0) search->gain = fmax((over - search->before) / way, 1.0);
    search->from = search->at, search->before = over;
    search->astray = left > 0.5 * search->left ? search->astray + 1 : 0, search->left = left;
    I k = search->tries++;
    /* Never a shorter way, so that the root is passed and held from both sides: a step that is short
       since the gain was too large proves nothing. */
    D low = search->low, high = search->high, below = search->below, above = search->above;
    bool known = below != 0.0 && above != 0.0;
    if (k < SECANTS) search->at -= copysign(fmax(fabs(over) / search->gain, same), over);
    else search->at = fmin(fmax(low + left * below / (below - above), low + same), high - same);
    bool tried = (search->at <= low && below != 0.0) || (search->at >= high && above != 0.0);
    if (tried || (k >= SECANTS && (!known || search->astray >= ASTRAY)))
        search->at = low + 0.5 * left, search->astray = 0;
    search->at = fmin(fmax(search->at, low), high);
    return false;
}

/* What the laws of a rope's winches command, into found, where these turn at speeds (m/s) and the
   rope has a mean tension (N). */
static I command(const Asked *asked, const D *at, D mean) {
    const Answering *own = asked->own;
    D *told = own->told.at, elapsed = own->elapsed.at[0], ratios[2];
    if (!ratios_at(asked, at, ratios)) return RAISED;
    for (I k = 0; k < asked->count; k++) {
        I winch = asked->winches[k];
        const D *limits = own->limits.at + 2 * winch, *slopes = own->slopes.at + 2 * winch;
        told[TENSION] = mean * ratios[k];
        told[PATH_RATE] = asked->follow / (D)asked->count;
        told[PATH_SLOPE] = slopes[0] + elapsed * slopes[1];
        told[TIME] = own->since.at[winch] + elapsed;
        lag(asked, winch, told);
        if (!answered(asked->ask, LAWS + QUESTIONS * winch + COMMAND)) return RAISED;
        if (isnan(told[SAID])) return ENDLESS;
        own->found.at[winch] = fmin(fmax(told[SAID], limits[0]), limits[1]);
    }
    return BALANCED;
}

/* The same of two winches that turn at a total speed: by how much the first is the faster one goes
   with what their laws command.  That of the step before would not do: each end that is ahead finds
   more tension, falls behind in this step, and is ahead again in the next, however short they are. */
static I command_both(const Asked *asked, D total, D mean) {
    const Answering *own = asked->own;
    const I *winch = asked->winches;
    const D *limits[] = {own->limits.at + 2 * winch[0], own->limits.at + 2 * winch[1]};
    D *balance = own->balance.at + BALANCE * asked->rope;
    Search apart = search_from(balance[APART], balance[APART_GAIN], limits[0][0] - limits[1][1],
                               limits[0][1] - limits[1][0]);
    for (;;) {
        D at[] = {0.5 * (total + apart.at), 0.5 * (total - apart.at)};
        I how = command(asked, at, mean);
        if (how != BALANCED) return how;
        D over = apart.at - (own->found.at[winch[0]] - own->found.at[winch[1]]);
        if (ends(&apart, over, fmax(fabs(total), fabs(apart.at)))) break;
    }
    balance[APART] = apart.at, balance[APART_GAIN] = apart.gain;
    return BALANCED;
}

/* How much faster the winches of a rope turn at a speed (m/s) of all than their laws command. */
static I excess(const Asked *asked, D total, D *over) {
    D left = asked->natural - wound_by(&asked->weights, total);
    D mean = tension_of(asked->ropes->material.at + 3 * asked->rope, left, total + asked->rest,
                        asked->path);
    I how = asked->count == 1 ? command(asked, &total, mean) : command_both(asked, total, mean);
    *over = total;
    for (I k = 0; k < asked->count; k++) *over -= asked->own->found.at[asked->winches[k]];
    return how == BALANCED && isnan(*over) ? ENDLESS : how;
}

/* The speeds of the winches that answer to a rope, into found. */
static I answer(const Asked *asked) {
    const Answering *own = asked->own;
    const D question[] = {own->elapsed.at[0], asked->path.length, asked->path.rate, asked->natural,
                          asked->rest};
    D *known = own->asked.at + 5 * asked->rope, *balance = own->balance.at + BALANCE * asked->rope;
    D low = 0.0, high = 0.0, over = 0.0;
    bool same = true;
    /* A tangent asks what its residual has asked. */
    for (I k = 0; k < 5; k++) same = same && known[k] == question[k];
    if (same) return BALANCED;
    known[0] = NAN;
    for (I k = 0; k < asked->count; k++) {
        const D *limits = own->limits.at + 2 * asked->winches[k];
        low += limits[0], high += limits[1];
    }
    Search total = search_from(balance[TOTAL], balance[TOTAL_GAIN], low, high);
    do {
        I how = excess(asked, total.at, &over);
        if (how != BALANCED) return how;
    } while (!ends(&total, over, fabs(total.at)));
    balance[TOTAL] = total.at, balance[TOTAL_GAIN] = total.gain;
    /* Steep commands amplify the last bits of the total: share these out. */
    for (I k = 0; k < asked->count; k++) {
        D *found = own->found.at + asked->winches[k];
        *found = asked->count == 1 ? total.at : *found + over / (D)asked->count;
    }
    memcpy(known, question, sizeof question);
    return BALANCED;
}

/* What is asked of a rope, at its place; no winches if none answers. */
static Asked asked_of(const Answering *own, const RopeTable *ropes, Ask ask, I rope, Place place) {
    I near = 2 * place.cable, count = ropes->starts.n, cables = own->on.n;
    const D *wound = own->held.at, *speeds = own->held.at + 2 * cables;
    Asked found = {.own = own, .ropes = ropes, .ask = ask, .rope = rope};
    found.path = (Path){own->paths.at[rope], own->paths.at[count + rope]};
    found.natural = ropes->content.at[rope];
    for (I end = 0; end < 2; end++) {
        if (!(end ? place.ends : place.begins)) continue;
        found.natural -= wound[near + end];
        found.rest += speeds[near + end];
        if (own->on.at[near + end]) found.winches[found.count++] = near + end;
    }
    if (found.count) {
        found.weights = weights_of(own, rope);
        found.follow = -takeup_of(&found);
    }
    return found;
}

/* Rope wound and speeds of all winches, into turned, for the paths of all ropes; others are held. */
I turn_winches(const Answering *own, const RopeTable *ropes, Ask ask) {
    I ends = 2 * own->on.n;
    D *wound = own->turned.at, *speeds = own->turned.at + ends;
    Place place = {-1, false, false};
    memcpy(wound, own->held.at, (size_t)(2 * ends) * sizeof(D));
    for (I rope = 0; rope < ropes->starts.n; rope++) {
        place = place_behind(ropes, rope, place);
        Asked asked = asked_of(own, ropes, ask, rope, place);
        if (!asked.count) continue;
        I how = answer(&asked);
        if (how != BALANCED) return how;
        D total = own->balance.at[BALANCE * rope];
        /* All share what they wind together by their speeds. */
        D lasting = total == 0.0 ? own->elapsed.at[0] : wound_by(&asked.weights, total) / total;
        for (I k = 0; k < asked.count; k++) {
            I winch = asked.winches[k];
            speeds[winch] = own->found.at[winch];
            wound[winch] += own->found.at[winch] * lasting;
        }
    }
    return BALANCED;
}

/* Share of a change of path that stretches each rope, not answered by its winches. */
I find_left(const Answering *own, const RopeTable *ropes, Ask ask, D *left, I n) {
    Place place = {-1, false, false};
    for (I rope = 0; rope < n; rope++) {
        place = place_behind(ropes, rope, place);
        Asked asked = asked_of(own, ropes, ask, rope, place);
        left[rope] = 1.0;
        if (!asked.count) continue;
        D wound[2];
        for (I k = 0; k < 2; k++) {
            asked.path.length = own->paths.at[rope] + (D)k * NUDGE;
            asked.follow = -takeup_of(&asked);
            I how = answer(&asked);
            if (how != BALANCED) return how;
            wound[k] = wound_by(&asked.weights, own->balance.at[BALANCE * rope]);
        }
        left[rope] = fmin(fmax(1.0 + (wound[1] - wound[0]) / NUDGE, 0.0), 1.0);
    }
    return BALANCED;
}

/* See ratios_at, of a winch by its number, 2 cable + end; -1 for one that does not answer. */
D ratio_of_winch(const Answering *own, const RopeTable *ropes, Ask ask, I winch, D speed) {
    Place place = {-1, false, false};
    for (I rope = 0; rope < ropes->starts.n; rope++) {
        place = place_behind(ropes, rope, place);
        Asked asked = asked_of(own, ropes, ask, rope, place);
        D at[2] = {0.0, 0.0}, ratios[2];
        for (I k = 0; k < asked.count; k++)
            at[k] = asked.winches[k] == winch ? speed : own->speeds.at[2 * asked.winches[k]];
        for (I k = 0; k < asked.count; k++)
            if (asked.winches[k] == winch) return ratios_at(&asked, at, ratios) ? ratios[k] : -1.0;
    }
    return -1.0;
}
