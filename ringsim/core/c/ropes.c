/* The law of the ropes: tensions of all spans, and how they change; see ringsim/core/tension.py. */

#include "core.h"

/* Sine of the angle between the pulls below which its derivative is taken as zero: far above the
   rounding of unit vectors (1e-16), far below the angles of any path that bends. */
static const D STRAIGHT = 1e-7;

/* Lengths, rates, directions and angles of places and rates of the points; returns the least
   length, m. */
D measure(const RopeTable *ropes, const D *places, I n_places, const D *rates, I n_rates,
          const Spans *spans) {
    (void)n_places, (void)n_rates;
    const I *behind = ropes->behind.at;
    D least = INFINITY;
    for (I i = 0; i < spans->length.n; i++) {
        I k = 3 * ropes->near.at[i];
        Vec apart = minus(vector(places + k + 3), vector(places + k));
        D length = sqrt(dot(apart, apart));
        Vec unit = times(1.0 / length, apart);
        spans->length.at[i] = length;
        if (length < least || isnan(length)) least = length;
        store_vector(spans->unit.at + 3 * i, unit);
        spans->rate.at[i] = dot(unit, minus(vector(rates + k + 3), vector(rates + k)));
    }
    for (I j = 0; j < ropes->behind.n; j++) {
        Vec before = vector(spans->unit.at + 3 * (behind[j] - 1)), after = vector(spans->unit.at + 3 * behind[j]);
        Vec both = plus(before, after), apart = minus(after, before);
        spans->angle.at[j] = 2.0 * atan2(sqrt(dot(both, both)), sqrt(dot(apart, apart)));
    }
    return least;
}

static Path path_of(const RopeTable *ropes, const Spans *spans, I rope) {
    Path found = {0.0, 0.0};
    for (I i = ropes->starts.at[rope]; i < ropes->ends.at[rope]; i++) {
        found.length += spans->length.at[i];
        found.rate += spans->rate.at[i];
    }
    return found;
}

/* Lengths of all paths, and their rates behind them. */
void find_paths(const RopeTable *ropes, const Spans *spans, D *paths) {
    I count = ropes->starts.n;
    for (I rope = 0; rope < count; rope++) {
        Path found = path_of(ropes, spans, rope);
        paths[rope] = found.length, paths[count + rope] = found.rate;
    }
}

/* Of the rope behind another one, whose place this is; of the first one behind {-1}. */
Place place_behind(const RopeTable *ropes, I rope, Place before) {
    const I *near = ropes->near.at, first = ropes->starts.at[rope], behind = ropes->ends.at[rope];
    bool begins = first == 0 || near[first] != near[first - 1] + 1;
    bool ends = behind == ropes->near.n || near[behind] != near[behind - 1] + 1;
    return (Place){before.cable + begins, begins, ends};
}

/* Let the winches at both ends of each cable have wound so much (m), at rates (m/s). */
void wind(const RopeTable *ropes, const D *wound, I n_wound, const D *rates, I n_rates, const Drums *drums) {
    (void)n_wound, (void)n_rates;
    Place place = {-1, false, false};
    for (I rope = 0; rope < ropes->starts.n; rope++) {
        place = place_behind(ropes, rope, place);
        const D *turned = wound + 2 * place.cable, *rate = rates + 2 * place.cable;
        D near = place.begins ? turned[0] : 0.0, far = place.ends ? turned[1] : 0.0;
        /* A rope that holds nothing is wound up, and that is all. */
        D taken = ropes->alive.at[rope] > 0.0 ? near + far : 0.0;
        drums->natural.at[rope] = ropes->content.at[rope] - taken;
        near = place.begins ? rate[0] : 0.0, far = place.ends ? rate[1] : 0.0;
        drums->winding.at[rope] = near + far;
        drums->inflow.at[rope] = -far;
    }
}

/* Speeds of the ropes over the pulleys, and exponents of their friction. */
void slide(const RopeTable *ropes, const Drums *drums, const Spans *spans) {
    for (I rope = 0; rope < ropes->starts.n; rope++) {
        Path path = path_of(ropes, spans, rope);
        D natural = drums->natural.at[rope], beyond = path.length, rate_beyond = path.rate;
        for (I i = ropes->starts.at[rope]; i < ropes->ends.at[rope]; i++) {
            if (i > ropes->starts.at[rope]) {
                I j = ropes->pulley.at[i];
                D part = beyond / path.length;
                D moved = (rate_beyond - part * path.rate) * natural / path.length;
                D speed = drums->inflow.at[rope] + drums->winding.at[rope] * part - moved;
                if (j >= 0) {
                    spans->speed.at[j] = speed;
                    spans->exponent.at[j] = tanh(speed / ropes->slip_speed.at[j]);
                }
            }
            beyond -= spans->length.at[i];
            rate_beyond -= spans->rate.at[i];
        }
    }
}

/* Elastic and viscous force of a rope before slack, of a material and a natural length (m) that winches
   take up at a rate (m/s). */
static D force_of(const D *material, D natural, D winding, Path path) {
    D ratio = path.length / natural, strain_rate = (path.rate + ratio * winding) / natural;
    D stretch = ratio - 1.0 + material[1] * strain_rate;
    return stretch * material[0];
}

/* Tension of a force, slack within a width, without compression. */
static D smooth(D force, D width) {
    return larger(force, 0.0) + width * log1p(exp(larger(-fabs(force) / width, -200.0)));
}

/* Mean tension (N) of a rope that is whole. */
D tension_of(const D *material, D natural, D winding, Path path) {
    return smooth(force_of(material, natural, winding, path), material[2]);
}

/* Tensions of all spans, whose speeds are known. */
void tighten(const RopeTable *ropes, const Drums *drums, const D *log_decays, I pulleys,
             const Spans *spans) {
    (void)pulleys;
    D *share = spans->share.at;
    for (I rope = 0; rope < ropes->starts.n; rope++) {
        I first = ropes->starts.at[rope], last = ropes->ends.at[rope];
        Path path = path_of(ropes, spans, rope);
        D log = 0.0, most = 0.0, mean = 0.0;
        for (I i = first; i < last; i++) {
            if (i > first && ropes->pulley.at[i] >= 0) {
                I j = ropes->pulley.at[i];
                log += spans->exponent.at[j] * log_decays[j];
                if (log > most) most = log;
            }
            share[i] = log;
        }
        for (I i = first; i < last; i++) {
            share[i] = exp(share[i] - most);
            mean += share[i] * spans->length.at[i] / path.length;
        }
        D tension = ropes->alive.at[rope] * tension_of(ropes->material.at + 3 * rope,
                                                       drums->natural.at[rope],
                                                       drums->winding.at[rope], path);
        for (I i = first; i < last; i++) {
            share[i] /= mean;
            spans->tension.at[i] = tension * share[i];
        }
    }
}

/* The integral of the tension over the elastic force y up to this one, N^2: b^2 (-Li2(-exp(y / b)))
   with the slack width b.  For s <= 1

       -Li2(-s) = Li2(x) + ln(1 + s)^2 / 2,  x = s / (1 + s) <= 1 / 2,

   whose series loses half of what is left with each term; larger ones follow from its inversion,
   -Li2(-exp z) = z^2 / 2 + pi^2 / 6 + Li2(-exp(-z)) (DLMF 25.12.3, 25.12.4). */
static D energy_of(D force, D width) {
    static const D SIXTH = 1.6449340668482264; /* pi^2 / 6 */
    enum { TERMS = 48 };
    D z = force / width, s = exp(-fabs(z)), x = s / (1.0 + s), sum = 0.0, log = log1p(s);
    /* Beside z^2 / 2 nothing of it is left. */
    if (z > 40.0) return width * width * (0.5 * z * z + SIXTH);
    for (I k = TERMS; k > 0; k--) sum = x * (1.0 / (D)(k * k) + sum);
    sum += 0.5 * log * log;
    return width * width * (z > 0.0 ? 0.5 * z * z + SIXTH - sum : sum);
}

static D *append(D *to, const D *from, I n) {
    memcpy(to, from, (size_t)n * sizeof(D));
    return to + n;
}

/* What a chain tells whose spans are known, one behind the other (ringsim.cable.ropes.CHAIN_PARTS). */
void read_chain(const RopeTable *ropes, const Drums *drums, const Spans *spans, const D *log_decays,
                I n_log_decays, const D *wound, I n_wound, const D *wound_rate, I n_wound_rate, D *out,
                I n_out) {
    (void)n_log_decays, (void)n_out;
    const I *behind = ropes->behind.at;
    I count = ropes->starts.n, n = spans->length.n, pulleys = ropes->behind.n, j = pulleys - 1;
    out = append(append(out, spans->length.at, n), spans->rate.at, n);
    out = append(append(out, spans->tension.at, n), spans->share.at, n);
    out = append(append(out, spans->unit.at, 3 * n), spans->angle.at, pulleys);
    out = append(append(out, spans->speed.at, pulleys), spans->exponent.at, pulleys);
    D *forces = append(out, log_decays, pulleys), *held = forces + pulleys;
    out = append(append(held + pulleys, drums->natural.at, count), drums->winding.at, count);
    for (I rope = count - 1; rope >= 0; rope--) {
        const D *material = ropes->material.at + 3 * rope;
        Path path = path_of(ropes, spans, rope);
        D natural = drums->natural.at[rope], winding = drums->winding.at[rope], width = material[2];
        D alive = ropes->alive.at[rope], strain = alive * (path.length / natural - 1.0);
        D elastic = strain * material[0], mean = alive * tension_of(material, natural, winding, path);
        out[rope] = path.length, out[count + rope] = path.rate, out[2 * count + rope] = strain;
        out[3 * count + rope] = (path.rate + path.length / natural * winding) / natural;
        out[4 * count + rope] = force_of(material, natural, winding, path), out[5 * count + rope] = mean;
        out[6 * count + rope] = mean - alive * smooth(elastic, width);
        out[7 * count + rope] = alive * energy_of(elastic, width) / material[0];
        D beyond = 0.0;
        for (I i = ropes->ends.at[rope] - 1; i >= ropes->starts.at[rope]; i--) {
            beyond += spans->length.at[i];
            if (j < 0 || behind[j] != i) continue;
            D lost = -expm1(spans->exponent.at[j] * log_decays[j]) * (ropes->pulley.at[i] >= 0);
            forces[j] = spans->tension.at[i - 1] * lost * (1.0 + strain);
            held[j] = beyond * natural / path.length;
            j--;
        }
    }
    append(append(out + 8 * count, wound, n_wound), wound_rate, n_wound_rate);
}

/* Let laws see the pulleys (ringsim.cable.friction.Pulleys). */
static void show(const RopeTable *ropes, const Spans *spans, const PulleyLaws *laws, const Tape *tape) {
    const I *behind = ropes->behind.at;
    D *angle = row_of(tape, 0), *speed = row_of(tape, 1), *tension = row_of(tape, 2);
    for (I j = 0; j < ropes->behind.n; j++) {
        D both = 0.5 * (spans->tension.at[behind[j] - 1] + spans->tension.at[behind[j]]);
        angle[j] = spans->angle.at[j], speed[j] = fabs(spans->speed.at[j]);
        tension[j] = larger(both, laws->least_tension);
    }
}

/* Rows of the results of decays and of slopes, behind what laws see. */
enum { DECAY = 3, BY_ANGLE = 3, BY_SPEED };

/* Spans, with their tensions, at places and rates of the points; returns the least length, NaN if no
   tensions go with the friction. */
D pull_tight(const RopeTable *ropes, const Drums *drums, const PulleyLaws *laws, const D *places,
             I n_places, const D *rates, I n_rates, const Spans *spans) {
    D least = measure(ropes, places, n_places, rates, n_rates, spans);
    I pulleys = ropes->behind.n;
    D *decays = row_of(&laws->decays, DECAY), before[pulleys + 1];
    slide(ropes, drums, spans);
    if (!laws->loads) {
        show(ropes, spans, laws, &laws->decays);
        play(&laws->decays);
        tighten(ropes, drums, decays, pulleys, spans);
        return least;
    }
    memset(decays, 0, (size_t)pulleys * sizeof(D));
    memset(before, 0, sizeof before);
    tighten(ropes, drums, decays, pulleys, spans);
    for (I n = 0; n < laws->most; n++) {
        show(ropes, spans, laws, &laws->decays);
        play(&laws->decays);
        tighten(ropes, drums, decays, pulleys, spans);
        D change = 0.0;
        for (I j = 0; j < pulleys; j++) {
            D own = fabs(decays[j] - before[j]);
            if (own > change || isnan(own)) change = own;
            before[j] = decays[j];
        }
        if (change < laws->solved) return least;
    }
    return NAN;
}

/* Whether the friction of the pulley before a span changes with speed. */
static bool turns(const RopeTable *ropes, const D *slopes, I span) {
    return ropes->pulley.at[span] >= 0 && slopes[ropes->pulley.at[span]] != 0.0;
}

/* Number of factors that tension_changes finds with these slopes (s/m). */
I factors_needed(const RopeTable *ropes, const D *slopes, I pulleys) {
    (void)pulleys;
    I count = 0;
    for (I rope = 0; rope < ropes->starts.n; rope++) {
        if (!(ropes->alive.at[rope] > 0.0)) continue;
        I own = 0;
        bool begun = false;
        for (I b = ropes->starts.at[rope] + 1; b < ropes->ends.at[rope]; b++) {
            begun = begun && ropes->felt.at[b - 1] == 0;
            if (turns(ropes, slopes, b)) {
                own += !begun;
                begun = true;
            }
        }
        count += own + 1 + (own > 0);
    }
    return count;
}

/* Slope of a pulley's friction over that at rest below which Newton's tangent does without it, unless
   Newton has seen the pulley on both sides: see ringsim.core.tension. */
static const D PASSING = 2e-4;

/* What ringsim.cable.ropes and ringsim.core.tension count with, too. */
D limit_of_ropes(I number) { return number == 0 ? SHORTEST : PASSING; }

static D drawing(const Roped *roped, I rope) {
    const D *material = roped->ropes.material.at + 3 * rope;
    return force_of(material, roped->drums.natural.at[rope], roped->drums.winding.at[rope],
                    path_of(&roped->ropes, &roped->spans, rope));
}

/* Remember an iterate's forces of the ropes, before slack. */
void note_forces(const Roped *roped) {
    I count = roped->ropes.starts.n;
    D forces[count + 1];
    for (I rope = 0; rope < count; rope++) forces[rope] = drawing(roped, rope);
    note_rates(&roped->drawn, forces, count);
}

/* Slopes of the ropes' tensions after these forces.  A slack rope that Newton has seen taut within
   the step has that of the secant: tangents of either side would lead to the other one for ever,
   where a damped rope holds what has no inertia. */
static void find_tight(const Roped *roped) {
    for (I rope = 0; rope < roped->ropes.starts.n; rope++) {
        D width = roped->ropes.material.at[3 * rope + 2], force = drawing(roped, rope);
        D own = 0.5 + 0.5 * tanh(0.5 * force / width), there = rate_across(&roped->drawn, rope);
        roped->tight.at[rope] = slope_between(&roped->drawn, rope, force, own, smooth(force, width),
                                              smooth(there, width));
    }
}

/* Slopes (s/m) of the pulleys' exponents after the ropes' speeds, with those of laws of speed, as far
   as tangents need them, and of tensions after forces; plays the laws' derivatives.  Returns the
   number of factors. */
I find_slopes(const Roped *roped, const PulleyLaws *laws) {
    const RopeTable *ropes = &roped->ropes;
    const Spans *spans = &roped->spans;
    I pulleys = ropes->behind.n;
    D *slopes = roped->slopes.at;
    find_tight(roped);
    show(ropes, spans, laws, &laws->slopes);
    play(&laws->slopes);
    const D *decays = row_of(&laws->decays, DECAY), *by_speed = row_of(&laws->slopes, BY_SPEED);
    for (I j = 0; j < pulleys; j++) {
        D slip = ropes->slip_speed.at[j], exponent = spans->exponent.at[j], speed = spans->speed.at[j];
        D own = (1.0 - exponent * exponent) / slip;
        D there = tanh(rate_across(&roped->seen, j) / slip);
        D found = slope_between(&roped->seen, j, speed, own, exponent, there);
        slopes[j] = found * slip > PASSING || found > own ? found : 0.0;
        if (!laws->moves) continue;
        D more = fabs(exponent) * by_speed[j] / (decays[j] < -1e-300 ? decays[j] : -1e-300);
        if (fabs(more) * slip > PASSING) slopes[j] += more;
    }
    return factors_needed(ropes, slopes, pulleys);
}

/* A pulley's friction changes all spans behind it, less their share of the path: how it changes with
   the differences of the points, into the changes of a row, and by it the share of all. */
typedef struct {
    D by_place, by_rate, ratio, steadily, path, path_rate;
} Rope;

static void by_speed(const Rope *rope, D felt, D part, D part_rate, D tail, I first, I last, I b,
                     const Spans *spans, const D *swing, D *changes, D *longer) {
    D share = part / rope->path;
    for (I i = first; i < last; i++) {
        D here = i >= b ? 1.0 : 0.0, rate_part = -rope->ratio * felt * (here - share);
        D length_part = felt * (rope->steadily / rope->path * (here - share) +
                                rope->ratio / rope->path * (part_rate - share * rope->path_rate));
        Vec change = plus(times(rope->by_place * length_part + rope->by_rate * rate_part,
                                vector(spans->unit.at + 3 * i)),
                          times(rope->by_place * rate_part, vector(swing + 3 * i)));
        add_vector(changes + 3 * i, change);
        add_vector(longer + 3 * (i - first), times(-tail / rope->path, change));
    }
}

static void by_angle(const Rope *rope, D slope, D tail, I first, I b, const Spans *spans, D *changes,
                     D *longer) {
    Vec before = vector(spans->unit.at + 3 * (b - 1)), after = vector(spans->unit.at + 3 * b);
    D cosine = dot(before, after);
    Vec aside = minus(after, times(cosine, before));
    D sine = sqrt(dot(aside, aside));
    if (sine <= STRAIGHT) return;
    D bent = rope->by_place * slope / sine;
    Vec ahead = times(bent / spans->length.at[b - 1], aside);
    Vec back = times(bent / spans->length.at[b], minus(before, times(cosine, after)));
    add_vector(changes + 3 * (b - 1), ahead);
    add_vector(changes + 3 * b, back);
    add_vector(longer + 3 * (b - 1 - first), times(-tail / rope->path, ahead));
    add_vector(longer + 3 * (b - first), times(-tail / rope->path, back));
}

/* Changes of tension in k factors: tensions of the spans (N), shape (k, spans), and what they change
   with, after the differences of the points, (k, spans, 3); both zeros before.

   Derivatives after places are taken by_place times, those after rates by_rate times.  The first
   factor of a rope is that of its mean tension, whose slope after its force is tight, with the share
   left of its stiffness that its winches do not answer.  log_slopes are the derivatives of log_decays after the angles, 1/rad, slopes those
   of the exponents after the rope's speed, s/m.

   A pulley's friction changes all spans behind it, less their share of the path.  Pulleys between
   which no span is felt change the same ones, and have one factor; their shares of the path go to the
   last factor of the rope. */
void tension_changes(const RopeTable *ropes, const Drums *drums, const D *log_decays, I n_decays,
                     const D *log_slopes, I n_log_slopes, const D *slopes, I n_slopes,
                     const Spans *spans, const D *velocities, I n_velocities, const D *tight,
                     I n_tight, const D *left, I n_left, D by_place, D by_rate, D *pulls, I n_pulls, D *changes, I n_changes) {
    (void)n_decays, (void)n_log_slopes, (void)n_slopes, (void)n_velocities, (void)n_tight, (void)n_left,
        (void)n_pulls, (void)n_changes;
    I n = spans->length.n;
    D swing[3 * n + 1], longer[3 * n + 1];
    for (I i = 0; i < n; i++) {
        const D *near = velocities + 3 * ropes->near.at[i];
        Vec moving = minus(vector(near + 3), vector(near));
        Vec aside = minus(moving, times(spans->rate.at[i], vector(spans->unit.at + 3 * i)));
        D length = spans->length.at[i];
        store_vector(swing + 3 * i, (Vec){aside.x / length, aside.y / length, aside.z / length});
    }
    I row = 0;
    for (I r = 0; r < ropes->starts.n; r++) {
        if (ropes->alive.at[r] == 0.0) continue;
        I first = ropes->starts.at[r], last = ropes->ends.at[r];
        Path path = path_of(ropes, spans, r);
        const D *material = ropes->material.at + 3 * r;
        D natural = drums->natural.at[r], winding = drums->winding.at[r];
        D elastic = material[0] / natural * tight[r], viscous = elastic * material[1];
        D own = by_place * left[r];
        D stretched = own * (elastic + viscous * winding / natural) + by_rate * viscous;
        for (I i = first; i < last; i++) {
            D *to = changes + 3 * (row * n + i);
            pulls[row * n + i] = spans->share.at[i];
            add_vector(to, times(stretched, vector(spans->unit.at + 3 * i)));
            add_vector(to, times(own * viscous, vector(swing + 3 * i)));
        }
        row++;
        Rope rope = {by_place, by_rate, natural / path.length, 0.0, path.length, path.rate};
        rope.steadily = winding + rope.ratio * path.rate;
        bool turned = false, begun = false;
        D part = path.length, part_rate = path.rate, tail = path.length;
        memset(longer, 0, (size_t)(3 * (last - first)) * sizeof(D));
        for (I b = first + 1; b < last; b++) {
            part -= spans->length.at[b - 1];
            part_rate -= spans->rate.at[b - 1];
            tail -= spans->share.at[b - 1] * spans->length.at[b - 1];
            if (begun && ropes->felt.at[b - 1] > 0) row++, begun = false;
            if (!turns(ropes, slopes, b)) continue;
            I j = ropes->pulley.at[b];
            D *to = changes + 3 * row * n;
            if (!begun)
                for (I i = b; i < last; i++) pulls[row * n + i] = spans->tension.at[i];
            by_speed(&rope, log_decays[j] * slopes[j], part, part_rate, tail, first, last, b, spans,
                     swing, to, longer);
            by_angle(&rope, spans->exponent.at[j] * log_slopes[j], tail, first, b, spans, to, longer);
            turned = begun = true;
        }
        if (!turned) continue;
        row += begun;
        for (I i = first; i < last; i++) {
            D *to = changes + 3 * (row * n + i);
            D stretch = by_place * (1.0 - spans->share.at[i]) / path.length;
            pulls[row * n + i] = spans->tension.at[i];
            add_vector(to, times(stretch, vector(spans->unit.at + 3 * i)));
            add_vector(to, vector(longer + 3 * (i - first)));
        }
        row++;
    }
}

/* The cables on frames. */

/* Arms and places of all points of the paths. */
void place_paths(const PathPoints *paths, const Pose *pose, const Arms *arms, D *out) {
    for (I n = 0; n < paths->frame.n; n++) {
        I frame = paths->frame.at[n], angle = paths->angle.at[n];
        Mat axes = axes_of(pose, frame);
        Vec arm = turn(&axes, vector(paths->arm.at + 3 * n)), swung = {0}, axis = {0};
        if (angle >= 0) {
            Mat drawn = matrix(paths->axes.at + 9 * n), own = mul(&axes, &drawn);
            Mat by = turned_about_z(paths->share.at[n] * pose->angle.at[angle]);
            swung = turn(&own, turn(&by, vector(paths->swung.at + 3 * n)));
            axis = times(paths->share.at[n], (Vec){own.a[2], own.a[5], own.a[8]});
        }
        arm = plus(arm, swung);
        store_vector(arms->whole.at + 3 * n, arm);
        store_vector(arms->swung.at + 3 * n, swung);
        store_vector(arms->axis.at + 3 * n, axis);
        store_vector(out + 3 * n, plus(place_of(pose, frame), arm));
    }
}

/* Add what forces on all points, shape (count, points, 3), do to the unknowns, (unknowns, columns),
   from the first column on. */
static void pull_paths(const PathPoints *paths, const Mesh *mesh, const Arms *arms, const D *forces,
                       I count, D *out, I columns, I first) {
    I points = paths->frame.n;
    for (I n = 0; n < points; n++) {
        D *to = out + mesh->home.at[paths->frame.at[n]] * columns + first;
        Vec arm = vector(arms->whole.at + 3 * n);
        Vec by_turn = cross(vector(arms->axis.at + 3 * n), vector(arms->swung.at + 3 * n));
        for (I c = 0; c < count; c++) {
            Vec force = vector(forces + 3 * (c * points + n)), moment = cross(arm, force);
            to[c] += force.x, to[columns + c] += force.y, to[2 * columns + c] += force.z;
            to[3 * columns + c] += moment.x, to[4 * columns + c] += moment.y, to[5 * columns + c] += moment.z;
            if (paths->angle.at[n] >= 0)
                out[mesh->angle_home.at[paths->angle.at[n]] * columns + first + c] += dot(by_turn, force);
        }
    }
}

/* Tighten the spans at places and rates of the points, and add what resists the pull of spans
   between frames to the residual; returns the least length of a span, m. */
D pull_cables(const System *system, const Roped *roped, const D *places, const D *rates, D *g) {
    const Mesh *mesh = &system->mesh;
    const PathPoints *paths = &system->paths;
    const Arms *arms = &system->arms;
    const Spans *spans = &roped->spans;
    D least = pull_tight(&roped->ropes, &roped->drums, &system->laws, places, 0, rates, 0, spans);
    for (I s = 0; s < paths->span.n; s++) {
        I span = paths->span.at[s];
        Vec force = times(spans->tension.at[span], vector(spans->unit.at + 3 * span));
        for (int side = 0; side < 2; side++) {
            I n = paths->near.at[s] + side, angle = paths->angle.at[n];
            Vec pull = side ? force : times(-1.0, force);
            push(g + mesh->home.at[paths->frame.at[n]], pull, cross(vector(arms->whole.at + 3 * n), pull));
            if (angle >= 0)
                g[mesh->angle_home.at[angle]] +=
                    dot(vector(arms->axis.at + 3 * n), cross(vector(arms->swung.at + 3 * n), pull));
        }
    }
    return least;
}

enum { SIDE = 7, BOTH_SIDES = 14 };

/* How the points at the ends of a span move with its unknowns, and what arms that turn under its
   constant pull add to the front. */
static void turn_arms(const PathPoints *paths, const Arms *arms, const Spans *spans, I s, D *front,
                      I columns, D legs[3][BOTH_SIDES]) {
    I span = paths->span.at[s];
    const I *local = paths->local.at + BOTH_SIDES * s;
    for (int side = 0; side < 2; side++) {
        I n = paths->near.at[s] + side;
        int own = SIDE * side;
        D sign = 2.0 * side - 1.0;
        Vec arm = vector(arms->whole.at + 3 * n), swung = vector(arms->swung.at + 3 * n),
            axis = vector(arms->axis.at + 3 * n), swing = cross(axis, swung);
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 6; j++) legs[i][own + j] = 0.0;
            legs[i][own + i] = sign;
        }
        legs[0][own + 6] = sign * swing.x, legs[1][own + 6] = sign * swing.y, legs[2][own + 6] = sign * swing.z;
        legs[0][own + 4] = sign * arm.z, legs[0][own + 5] = -sign * arm.y;
        legs[1][own + 3] = -sign * arm.z, legs[1][own + 5] = sign * arm.x;
        legs[2][own + 3] = sign * arm.y, legs[2][own + 4] = -sign * arm.x;
        /* Arms turn under a constant force that resists: as for the ends of elements. */
        Vec force = times(sign * spans->tension.at[span], vector(spans->unit.at + 3 * span));
        D along = dot(force, arm), b_along = dot(force, swung), z_along = dot(force, axis);
        Vec lifted = cross(swing, force);
        D a[3] = {arm.x, arm.y, arm.z}, f[3] = {force.x, force.y, force.z},
          lift[3] = {lifted.x, lifted.y, lifted.z}, b[3] = {swung.x, swung.y, swung.z},
          z[3] = {axis.x, axis.y, axis.z};
        I k = local[own + 6];
        for (int i = 0; i < 3; i++) {
            I row = local[own + 3 + i];
            for (int j = 0; j < 3; j++) front[row * columns + local[own + 3 + j]] += a[i] * f[j];
            front[row * columns + row] -= along;
            if (k >= 0) {
                front[row * columns + k] += lift[i];
                front[k * columns + row] += z_along * b[i] - b_along * z[i];
            }
        }
        if (k >= 0) front[k * columns + k] += dot(axis, lifted);
    }
}

/* Add how the pulls of spans between frames turn with the spans and the arms to the fronts. */
static void add_span_tangent(const PathPoints *paths, const Arms *arms, const Spans *spans,
                             const Fronts *fronts) {
    D legs[3][BOTH_SIDES], pulled[3][BOTH_SIDES];
    I columns = fronts->columns;
    for (I s = 0; s < paths->span.n; s++) {
        I span = paths->span.at[s];
        const I *local = paths->local.at + BOTH_SIDES * s;
        D *front = front_of(fronts, paths->front.at[s]);
        turn_arms(paths, arms, spans, s, front, columns, legs);
        /* T (1 - u u^T) / L: the tension turns with the span. */
        Vec unit = vector(spans->unit.at + 3 * span);
        D stiffness = spans->tension.at[span] / spans->length.at[span];
        for (int j = 0; j < BOTH_SIDES; j++) {
            Vec leg = {legs[0][j], legs[1][j], legs[2][j]};
            Vec aside = times(stiffness, minus(leg, times(dot(unit, leg), unit)));
            pulled[0][j] = aside.x, pulled[1][j] = aside.y, pulled[2][j] = aside.z;
        }
        for (int i = 0; i < BOTH_SIDES; i++) {
            if (local[i] < 0) continue;
            D *row = front + local[i] * columns;
            for (int first = 0; first < BOTH_SIDES; first += SIDE) {
                /* The six of a frame are neighbours. */
                D *to = row + local[first];
                I angle = local[first + 6];
                for (int j = 0; j < 6; j++)
                    to[j] += legs[0][i] * pulled[0][first + j] + legs[1][i] * pulled[1][first + j] +
                             legs[2][i] * pulled[2][first + j];
                if (angle >= 0)
                    row[angle] += legs[0][i] * pulled[0][first + 6] + legs[1][i] * pulled[1][first + 6] +
                                  legs[2][i] * pulled[2][first + 6];
            }
        }
    }
}

/* Changes of tension in factors as pulls on all points, and what they change with after places of
   all points, (2, count, points, 3), from those of spans. */
void spread_changes(const RopeTable *ropes, const Spans *spans, const D *pulls, I n_pulls,
                    const D *changes, I n_changes, D *out, I n_out) {
    (void)n_changes;
    I n = spans->length.n, count = n ? n_pulls / n : 0, half = n_out / 2, points = count ? half / (3 * count) : 0;
    for (I row = 0; row < count; row++)
        for (I i = 0; i < n; i++) {
            D *pull = out + 3 * (row * points + ropes->near.at[i]), *change = pull + half;
            D share = pulls[row * n + i];
            Vec own = times(share, vector(spans->unit.at + 3 * i)), with = vector(changes + 3 * (row * n + i));
            if (share == 0.0 && with.x == 0.0 && with.y == 0.0 && with.z == 0.0) continue; /* another rope */
            add_vector(pull, times(-1.0, own));
            add_vector(pull + 3, own);
            add_vector(change, times(-1.0, with));
            add_vector(change + 3, with);
        }
}

/* How all points move with so many changes of the unknowns, shape (unknowns, n): (points, 3, n). */
void move_paths(const PathPoints *paths, const Mesh *mesh, const Arms *arms, const D *x, I n, D *out) {
    for (I p = 0; p < paths->frame.n; p++) {
        const D *own = x + mesh->home.at[paths->frame.at[p]] * n, *turn = own + 3 * n;
        D *to = out + 3 * p * n;
        Vec arm = vector(arms->whole.at + 3 * p);
        for (I c = 0; c < n; c++) {
            D a = turn[c], b = turn[n + c], d = turn[2 * n + c];
            to[c] = own[c] + (b * arm.z - d * arm.y);
            to[n + c] = own[n + c] + (d * arm.x - a * arm.z);
            to[2 * n + c] = own[2 * n + c] + (a * arm.y - b * arm.x);
        }
        if (paths->angle.at[p] < 0) continue;
        Vec swing = cross(vector(arms->axis.at + 3 * p), vector(arms->swung.at + 3 * p));
        const D *angle = x + mesh->angle_home.at[paths->angle.at[p]] * n;
        for (I c = 0; c < n; c++) {
            to[c] += swing.x * angle[c], to[n + c] += swing.y * angle[c];
            to[2 * n + c] += swing.z * angle[c];
        }
    }
}

/* Add how spans turn to the fronts, and how tensions change to the border's columns, shape (unknowns,
   wide), from the first on, in so many factors; what they change with stays in the factors.  rates
   are those of the points (m/s), rate_by_place the derivative of rates after places (1/s). */
void add_cables(const System *system, const Roped *roped, const D *rates, D rate_by_place, I count,
                I wide, I first) {
    const Mesh *mesh = &system->mesh;
    const PathPoints *paths = &system->paths;
    const Arms *arms = &system->arms;
    const PulleyLaws *laws = &system->laws;
    const RopeTable *ropes = &roped->ropes;
    const Spans *spans = &roped->spans;
    I n = spans->length.n, all_points = 3 * count * paths->frame.n;
    /* Room of the table: a long ring's would be too large for a stack. */
    D *pulls = roped->pulls.at, *changes = roped->changes.at, *factors = roped->factors.at;
    memset(pulls, 0, (size_t)(count * n) * sizeof(D));
    memset(changes, 0, (size_t)(3 * count * n) * sizeof(D));
    memset(factors, 0, (size_t)(2 * all_points) * sizeof(D));
    tension_changes(ropes, &roped->drums, row_of(&laws->decays, DECAY), 0,
                    row_of(&laws->slopes, BY_ANGLE), 0, roped->slopes.at, 0, spans, rates, 0,
                    roped->tight.at, 0, roped->left.at, 0, 1.0, rate_by_place, pulls, 0, changes, 0);
    spread_changes(ropes, spans, pulls, count * n, changes, 0, factors, 2 * all_points);
    add_span_tangent(paths, arms, spans, &system->fronts);
    pull_paths(paths, mesh, arms, factors, count, roped->border.columns.at, wide, first);
}
