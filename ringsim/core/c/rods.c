/* Elastic rods and masses, four elements at a time: forces, energies and tangent.

   Formulas: ringsim/frame/state.py, and docs/theory/rods.md. */

#include "core.h"

/* Bending (rad) below which coefficients are taken by series: what these leave out is below 5e-16,
   and sines cost more. */
static const D SMALL = 0.1;

/* What an element holds, from its forces to its tangent: axes of its ends and middle; d, psi, n, w,
   m; c, e and c' / k; forces and moments on the ends and their arms in the frames. */
typedef struct {
    Mat4 end[2], middle;
    Vec4 d, psi, n, w, m, bend, force[2], moment[2], arm[2];
} Load;

/* Numbers that so many elements keep. */
I room_for_loads(I elements) {
    return (elements + LANES - 1) / LANES * (I)(sizeof(Load) / sizeof(D));
}

static Vec4 coefficients(Vec4 psi) {
    V square = dot4(psi, psi);
    V c = 7.0 / 5760.0 + square * (31.0 / 967680.0 + square * (127.0 / 154828800.0));
    V e = 1.0 / 384.0 + square * (1.0 / 15360.0 + square * (17.0 / 10321920.0));
    V slope = 31.0 / 241920.0 + square * (127.0 / 25804800.0 + square * (73.0 / 437944320.0));
    Vec4 found = {-(1.0 / 24.0 + square * c), 0.125 + square * e, -(7.0 / 2880.0 + square * slope)};
    if (any(square >= SMALL * SMALL))
        for (int n = 0; n < LANES; n++)
            if (square[n] >= SMALL * SMALL) {
                D s = square[n], k = sqrt(s), half = 0.5 * k, sine = sin(half);
                D own = (1.0 - half / sine) / s;
                found.x[n] = own, found.y[n] = tan(0.5 * half) / k * 0.5;
                found.z[n] = (half * cos(half) / sine - 1.0) / (4.0 * half * sine * s) - 2.0 * own / s;
            }
    return found;
}

/* Z a */
static inline Vec4 straightened(Vec4 psi, V c, Vec4 a) {
    return plus4(a, times4(c, cross4(psi, cross4(psi, a))));
}

/* G^T f, the moment by which a force straightens. */
static inline Vec4 bowed(Vec4 psi, Vec4 own, Vec4 y, Vec4 force) {
    V c = own.x, square = dot4(psi, psi), along = dot4(psi, y), across = dot4(psi, force),
      both = dot4(y, force);
    V whole = own.z * (along * across - square * both) - 2.0 * c * both;
    return plus4(times4(whole, psi), plus4(times4(c * across, y), times4(c * along, force)));
}

/* The elements of a group; the last group repeats its last element, which counts once. */
typedef struct {
    I element[LANES], live;
} Group;

static Group group_of(I number, I elements) {
    Group found;
    found.live = elements - LANES * number < LANES ? elements - LANES * number : LANES;
    for (I k = 0; k < LANES; k++)
        found.element[k] = LANES * number + (k < found.live ? k : found.live - 1);
    return found;
}

static I groups(const Mesh *mesh) { return (mesh->length.n + LANES - 1) / LANES; }

/* Of four rows of a table: their numbers of a place, and three from there on. */
static inline V gather(const D *from, I each, const I rows[LANES], I place) {
    return (V){from[each * rows[0] + place], from[each * rows[1] + place],
               from[each * rows[2] + place], from[each * rows[3] + place]};
}

static inline Vec4 gather_vector(const D *from, I each, const I rows[LANES], I place) {
    return (Vec4){gather(from, each, rows, place), gather(from, each, rows, place + 1),
                  gather(from, each, rows, place + 2)};
}

static inline Mat4 gather_matrix(const D *from, const I rows[LANES]) {
    Mat4 found;
    for (I k = 0; k < 9; k++) found.a[k] = gather(from, 9, rows, k);
    return found;
}

static inline Vec lane(Vec4 a, int k) { return (Vec){a.x[k], a.y[k], a.z[k]}; }

/* Strains u and psi of a group, into its load and their table; u is returned. */
static Vec4 strained(Load *own, const Group *group, V length, D *now) {
    Mat4 back = transposed4(&own->end[0]), apart = mul4(&back, &own->end[1]);
    own->psi = rotation_vector4(&apart);
    Mat4 half = turned4(times4(all(0.5), own->psi));
    own->middle = mul4(&own->end[0], &half);
    own->bend = coefficients(own->psi);
    Vec4 u = straightened(own->psi, own->bend.x, turn_back4(&own->middle, own->d));
    u.x -= length;
    for (int k = 0; k < group->live; k++) {
        D *to = now + 6 * group->element[k];
        store_vector(to, lane(u, k));
        store_vector(to + 3, lane(own->psi, k));
    }
    return u;
}

/* n, w and m of the force and moment in the middle's axes. */
static void carry(Load *own, Vec4 force, Vec4 moment) {
    V c = own->bend.x, e = own->bend.y;
    Vec4 psi = own->psi, y = turn_back4(&own->middle, own->d);
    own->n = turn4(&own->middle, straightened(psi, c, force));
    own->w = cross4(own->d, own->n);
    Vec4 bent = straightened(psi, c, plus4(moment, bowed(psi, own->bend, y, force)));
    own->m = plus4(turn4(&own->middle, bent),
                   times4(e, cross4(own->w, turn4(&own->middle, psi))));
}

/* Add forces of elastic rods and of inertia on all unknowns; keeps strains, and what elements hold in
   loads (room_for_loads).  Places and accelerations are those of all points, (p, 3). */
void add_forces(const Mesh *mesh, const Pose *pose, const D *points, I n_points,
                const D *accelerations, I n_accelerations, const Strains *strains, D *loads,
                I n_loads, D *g, I n_g) {
    (void)n_points, (void)n_accelerations, (void)n_loads, (void)n_g;
    I angles = pose->angle.n;
    D cosine[angles + 1], sine[angles + 1];
    for (I k = 0; k < angles; k++) cosine[k] = cos(pose->angle.at[k]), sine[k] = sin(pose->angle.at[k]);
    for (I b = 0; b < groups(mesh); b++) {
        Group group = group_of(b, mesh->length.n);
        const I *e = group.element;
        Load *own = (Load *)loads + b;
        Vec4 at[2], pulled[2];
        for (int s = 0; s < 2; s++) {
            I frame[LANES], point[LANES], side[LANES];
            V c, d;
            for (int k = 0; k < LANES; k++) {
                side[k] = 2 * e[k] + s;
                frame[k] = mesh->frame.at[side[k]], point[k] = mesh->point.at[side[k]];
                I angle = mesh->angle.at[side[k]];
                c[k] = angle < 0 ? 1.0 : cosine[angle], d[k] = angle < 0 ? 0.0 : sine[angle];
            }
            Mat4 body = gather_matrix(pose->axes.at, frame), drawn = gather_matrix(mesh->axes.at, side);
            Mat4 whole = mul4(&body, &drawn);
            for (int i = 0; i < 9; i += 3) {
                own->end[s].a[i] = c * whole.a[i] + d * whole.a[i + 1];
                own->end[s].a[i + 1] = c * whole.a[i + 1] - d * whole.a[i];
                own->end[s].a[i + 2] = whole.a[i + 2];
            }
            at[s] = gather_vector(points, 3, point, 0);
            pulled[s] = gather_vector(accelerations, 3, point, 0);
            own->arm[s] = minus4(at[s], gather_vector(pose->place.at, 3, frame, 0));
        }
        own->d = minus4(at[1], at[0]);
        Vec4 u = strained(own, &group, gather(mesh->length.at, 1, e, 0), strains->now.at);
        V tau = gather(mesh->tau.at, 1, e, 0);
        Vec4 whole[2] = {u, own->psi};
        for (int k = 0; k < 2; k++) {
            Vec4 rate = plus4(times4(all(strains->lead.at[0]), whole[k]),
                              gather_vector(strains->before.at, 6, e, 3 * k));
            Vec4 stiffness = gather_vector(mesh->stiffness.at, 6, e, 3 * k);
            whole[k] = plus4(whole[k], times4(tau, rate));
            whole[k] = (Vec4){stiffness.x * whole[k].x, stiffness.y * whole[k].y,
                              stiffness.z * whole[k].z};
        }
        carry(own, whole[0], whole[1]);
        V mass = gather(mesh->mass.at, 2, e, 0), other = gather(mesh->mass.at, 2, e, 1);
        for (int s = 0; s < 2; s++) {
            Vec4 inertia = plus4(times4(mass, pulled[s]), times4(other, pulled[1 - s]));
            Vec4 half = times4(all(0.5), own->w);
            own->force[s] = s ? plus4(inertia, own->n) : minus4(inertia, own->n);
            own->moment[s] = s ? minus4(own->m, half) : minus4(times4(all(-1.0), own->m), half);
            Vec4 moment = plus4(own->moment[s], cross4(own->arm[s], own->force[s]));
            Vec4 z = {own->end[s].a[2], own->end[s].a[5], own->end[s].a[8]};
            V about = dot4(z, own->moment[s]);
            for (int k = 0; k < group.live; k++) {
                I side = 2 * e[k] + s, angle = mesh->angle.at[side];
                push(g + mesh->home.at[mesh->frame.at[side]], lane(own->force[s], k), lane(moment, k));
                if (angle >= 0) g[mesh->angle_home.at[angle]] += about[k];
            }
        }
    }
    for (I p = 0; p < mesh->point_mass.n; p++)
        if (mesh->point_mass.at[p] > 0.0) {
            I frame = mesh->point_frame.at[p];
            Vec force = times(mesh->point_mass.at[p], vector(accelerations + 3 * p));
            Vec arm = minus(vector(points + 3 * p), place_of(pose, frame));
            push(g + mesh->home.at[frame], force, cross(arm, force));
        }
}

/* Kinetic energy of rods and points and elastic energy of rods, J. */
void energies_of(const Mesh *mesh, const D *velocities, I n_velocities, const D *strains,
                 I n_strains, D *out, I n_out) {
    (void)n_velocities, (void)n_strains, (void)n_out;
    D kinetic = 0.0, elastic = 0.0;
    for (I e = 0; e < mesh->length.n; e++) {
        Vec v1 = vector(velocities + 3 * mesh->point.at[2 * e]);
        Vec v2 = vector(velocities + 3 * mesh->point.at[2 * e + 1]);
        kinetic += 0.5 * mesh->mass.at[2 * e] * (dot(v1, v1) + dot(v2, v2));
        kinetic += mesh->mass.at[2 * e + 1] * dot(v1, v2);
        for (int k = 0; k < 6; k++)
            elastic += 0.5 * mesh->stiffness.at[6 * e + k] * strains[6 * e + k] * strains[6 * e + k];
    }
    for (I p = 0; p < mesh->point_mass.n; p++) {
        Vec v = vector(velocities + 3 * p);
        kinetic += 0.5 * mesh->point_mass.at[p] * dot(v, v);
    }
    out[0] = kinetic, out[1] = elastic;
}

/* The tangent. */

enum { SIDE = 7, BOTH = 14 };

/* What changes with the ends, by blocks of the two ends (s: whose force, t: whose change). */
typedef struct {
    Mat4 force_place[2][2], force_turn[2][2], moment_place[2][2], moment_turn[2][2];
} Blocks;

static void blocks_of(const Load *own, const V stiffness[6], V mass, V other, Blocks *out) {
    V c = own->bend.x, e = own->bend.y, zero = all(0.0), half = all(0.5);
    Vec4 d = own->d, n = own->n, w = own->w, bend = turn4(&own->middle, own->psi);
    Mat4 halves = {{half, zero, zero, zero, half, zero, zero, zero, half}};
    Mat4 a = in_space4(&own->middle, stiffness[0], stiffness[1]);
    Mat4 g = bow4(times4(c, bend), d), ag = mul4(&a, &g), back = transposed4(&g);
    Mat4 by_bend = add4(ag, bow4(times4(c, bend), n)), straight = transposed4(&by_bend);
    /* c (d n^T + n d^T - 2 d . n) */
    V m = -2.0 * c * dot4(d, n), xy = c * (d.x * n.y + d.y * n.x), yz = c * (d.y * n.z + d.z * n.y),
      zx = c * (d.z * n.x + d.x * n.z);
    Mat4 bow = {{m + 2.0 * c * d.x * n.x, xy, zx, xy, m + 2.0 * c * d.y * n.y, yz, zx, yz,
                 m + 2.0 * c * d.z * n.z}};
    Mat4 b = add4(add4(in_space4(&own->middle, stiffness[3], stiffness[4]), scale4(e, skew4(w))),
                  add4(mul4(&back, &ag), bow));
    Mat4 swing = skew4(times4(e, bend)), skewed = skew4(d), turning = skew4(w);
    Mat4 share[2] = {add4(halves, swing), less4(halves, swing)};
    Mat4 by_turn = less4(mul4(&a, &skewed), skew4(n));
    Mat4 wd = less4(across4(d, &a), skew4(n)), md = less4(straight, mul4(&swing, &wd));
    Mat4 q = less4(mul4(&straight, &skewed), add4(skew4(own->m), mul4(&swing, &turning)));
    for (int t = 0; t < 2; t++) {
        Mat4 p = mul4(&by_turn, &share[t]), mt = mul4(&q, &share[t]);
        p = t ? add4(p, by_bend) : less4(p, by_bend);
        Mat4 wt = across4(d, &p);
        mt = less4(t ? add4(mt, b) : less4(mt, b), mul4(&swing, &wt));
        for (int s = 0; s < 2; s++) {
            V sign = all(s ? 1.0 : -1.0), other_sign = all(t ? 1.0 : -1.0);
            out->force_place[s][t] = scale4(sign * other_sign, a);
            for (int k = 0; k < 9; k += 4) out->force_place[s][t].a[k] += s == t ? mass : other;
            out->force_turn[s][t] = scale4(sign, p);
            out->moment_place[s][t] = scale4(other_sign, less4(scale4(sign, md), scale4(half, wd)));
            out->moment_turn[s][t] = less4(scale4(sign, mt), scale4(half, wt));
        }
    }
}

/* From ends to frames: d x = d X - arm x d phi; the force's moment about the frame; and the joints'
   angles, of which z is the axis. */
static void in_frames(const Load *own, const Blocks *blocks, V k[BOTH][BOTH]) {
    Vec4 z[2];
    for (int s = 0; s < 2; s++)
        z[s] = (Vec4){own->end[s].a[2], own->end[s].a[5], own->end[s].a[8]};
    for (int s = 0; s < 2; s++)
        for (int t = 0; t < 2; t++) {
            const Mat4 *fx = &blocks->force_place[s][t], *mx = &blocks->moment_place[s][t];
            Mat4 arm = skew4(own->arm[t]);
            Mat4 fp = less4(blocks->force_turn[s][t], mul4(fx, &arm));
            Mat4 mp = less4(blocks->moment_turn[s][t], mul4(mx, &arm));
            Vec4 fz = turn4(&blocks->force_turn[s][t], z[t]), mz = turn4(&blocks->moment_turn[s][t], z[t]);
            Vec4 rz = plus4(mz, cross4(own->arm[s], fz));
            Mat4 rx = add4(*mx, across4(own->arm[s], fx)), rp = add4(mp, across4(own->arm[s], &fp));
            Vec4 ax = turn_back4(mx, z[s]), ap = turn_back4(&mp, z[s]);
            V(*to)[BOTH] = k + SIDE * s;
            int at = SIDE * t;
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++) {
                    to[i][at + j] = fx->a[3 * i + j], to[i][at + 3 + j] = fp.a[3 * i + j];
                    to[3 + i][at + j] = rx.a[3 * i + j], to[3 + i][at + 3 + j] = rp.a[3 * i + j];
                }
            to[0][at + 6] = fz.x, to[1][at + 6] = fz.y, to[2][at + 6] = fz.z;
            to[3][at + 6] = rz.x, to[4][at + 6] = rz.y, to[5][at + 6] = rz.z;
            to[6][at] = ax.x, to[6][at + 1] = ax.y, to[6][at + 2] = ax.z;
            to[6][at + 3] = ap.x, to[6][at + 4] = ap.y, to[6][at + 5] = ap.z;
            to[6][at + 6] = dot4(z[s], mz);
        }
    /* The arm and the joint's axis turn with the frame under constant force and moment:
       (d phi x a) x f = (a f^T - (f . a)) d phi, (d phi x z) . m = (z x m) . d phi. */
    for (int s = 0; s < 2; s++) {
        Vec4 arm = own->arm[s], force = own->force[s], aside = cross4(z[s], own->moment[s]);
        V a[3] = {arm.x, arm.y, arm.z}, f[3] = {force.x, force.y, force.z}, along = dot4(force, arm);
        V(*to)[BOTH] = k + SIDE * s;
        int at = SIDE * s + 3;
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) to[3 + i][at + j] += a[i] * f[j];
            to[3 + i][at + i] -= along;
        }
        to[6][at] += aside.x, to[6][at + 1] += aside.y, to[6][at + 2] += aside.z;
    }
}

static void scatter(const Mesh *mesh, const Group *group, const V k[BOTH][BOTH], const Fronts *fronts) {
    for (int lane = 0; lane < group->live; lane++) {
        I e = group->element[lane];
        const I *local = mesh->local.at + BOTH * e;
        D *front = front_of(fronts, mesh->part.at[e]);
        for (int i = 0; i < BOTH; i++) {
            if (local[i] < 0) continue;
            D *row = front + local[i] * fronts->columns;
            for (int side = 0; side < BOTH; side += SIDE) {
                D *to = row + local[side];
                for (int j = 0; j < 6; j++) to[j] += k[i][side + j][lane];
                if (local[side + 6] >= 0) row[local[side + 6]] += k[i][side + 6][lane];
            }
        }
    }
}

/* Points with mass of their own: those of frames in parts have no arm. */
static void add_points(const Mesh *mesh, const Pose *pose, const D *points, const D *accelerations,
                       D by_place, const Fronts *fronts) {
    for (I p = 0; p < mesh->point_mass.n; p++) {
        if (mesh->point_mass.at[p] == 0.0) continue;
        I frame = mesh->point_frame.at[p], columns = fronts->columns;
        const I *local = mesh->frame_local.at + 2 * frame;
        D mass = by_place * mesh->point_mass.at[p], *front = front_of(fronts, local[0]);
        D *to = front + local[1] * columns + local[1];
        Vec arm = minus(vector(points + 3 * p), place_of(pose, frame));
        Vec force = times(mesh->point_mass.at[p], vector(accelerations + 3 * p));
        D a[3] = {arm.x, arm.y, arm.z}, f[3] = {force.x, force.y, force.z};
        D along = dot(force, arm), square = dot(arm, arm);
        Mat s = skew(arm);
        for (int i = 0; i < 3; i++) {
            to[i * columns + i] += mass;
            to[(3 + i) * columns + 3 + i] += mass * square - along;
            for (int j = 0; j < 3; j++) {
                to[i * columns + 3 + j] -= mass * s.a[3 * i + j];
                to[(3 + i) * columns + j] += mass * s.a[3 * i + j];
                to[(3 + i) * columns + 3 + j] += a[i] * f[j] - mass * a[i] * a[j];
            }
        }
    }
}

/* Set the fronts to the derivative of add_forces, which has kept loads; lead and by_place are those
   of rates of strains after strains (1/s), and of accelerations after places (1/s^2). */
void begin_tangent(const Mesh *mesh, const Pose *pose, const D *points, I n_points,
                   const D *accelerations, I n_accelerations, const D *loads, I n_loads, D lead,
                   D by_place, const Fronts *fronts) {
    (void)n_points, (void)n_accelerations, (void)n_loads;
    /* Whole rows: a call for each would take longer than the rest of them. */
    for (I number = 0; number < mesh->size.n; number++)
        memset(front_of(fronts, number), 0, (size_t)(mesh->size.at[number] * fronts->columns) * sizeof(D));
    for (I b = 0; b < groups(mesh); b++) {
        Group group = group_of(b, mesh->length.n);
        const I *e = group.element;
        V more = 1.0 + lead * gather(mesh->tau.at, 1, e, 0), stiffness[6], k[BOTH][BOTH];
        for (int i = 0; i < 6; i++) stiffness[i] = more * gather(mesh->stiffness.at, 6, e, i);
        V mass = by_place * gather(mesh->mass.at, 2, e, 0), other = by_place * gather(mesh->mass.at, 2, e, 1);
        Blocks blocks;
        const Load *own = (const Load *)loads + b;
        blocks_of(own, stiffness, mass, other, &blocks);
        in_frames(own, &blocks, k);
        scatter(mesh, &group, k, fronts);
    }
    add_points(mesh, pose, points, accelerations, by_place, fronts);
}

/* Poses: how they move. */

/* Places of all points with mass, (p, 3). */
void place_points(const Mesh *mesh, const Pose *pose, D *out, I n_out) {
    (void)n_out;
    for (I n = 0; n < mesh->point_frame.n; n++) {
        I frame = mesh->point_frame.at[n];
        Mat axes = axes_of(pose, frame);
        Vec arm = turn(&axes, vector(mesh->point_arm.at + 3 * n));
        store_vector(out + 3 * n, plus(place_of(pose, frame), arm));
    }
}

/* Move a pose by changes of all unknowns, in place. */
void move(const Mesh *mesh, const Pose *pose, const D *step, I n_step) {
    (void)n_step;
    for (I f = 0; f < pose->place.n; f++) {
        const D *own = step + mesh->home.at[f];
        add_vector(pose->place.at + 3 * f, vector(own));
        Mat by = turned(vector(own + 3)), axes = axes_of(pose, f);
        axes = mul(&by, &axes);
        store(pose->axes.at + 9 * f, &axes);
    }
    for (I n = 0; n < pose->angle.n; n++) pose->angle.at[n] += step[mesh->angle_home.at[n]];
}

/* Changes of all unknowns from one pose to another. */
static void moved_between(const Mesh *mesh, const Pose *before, const Pose *after, D *out) {
    for (I f = 0; f < before->place.n; f++) {
        Mat axes = axes_of(before, f), back = transposed(&axes), now = axes_of(after, f);
        Mat by = mul(&now, &back);
        D *to = out + mesh->home.at[f];
        store_vector(to, minus(place_of(after, f), place_of(before, f)));
        store_vector(to + 3, rotation_vector(&by));
    }
    for (I n = 0; n < before->angle.n; n++)
        out[mesh->angle_home.at[n]] = after->angle.at[n] - before->angle.at[n];
}

/* Take what round-off has done to the axes out: R (3 - R^T R) / 2. */
void straighten(const Pose *pose) {
    const Mat most = {{1.5, 0.0, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0, 1.5}};
    for (I f = 0; f < pose->axes.n; f++) {
        Mat r = axes_of(pose, f), back = transposed(&r), square = mul(&back, &r);
        Mat by = add(most, scale(-0.5, square));
        r = mul(&r, &by);
        store(pose->axes.at + 9 * f, &r);
    }
}

/* A step: how it begins from a state, and what it has led to. */

/* Begin at the start, moved by changes of all unknowns, the hub's last. */
void set_out(const Mesh *mesh, const Moving *start, const Moving *now, const D *by, I n_by) {
    const Pose *from = &start->pose, *pose = &now->pose;
    memcpy(pose->place.at, from->place.at, (size_t)(3 * pose->place.n) * sizeof(D));
    memcpy(pose->axes.at, from->axes.at, (size_t)(9 * pose->axes.n) * sizeof(D));
    memcpy(pose->angle.at, from->angle.at, (size_t)pose->angle.n * sizeof(D));
    move(mesh, pose, by, 0);
    for (I k = 0; k < 3; k++) now->hub.at[k] = start->hub.at[k];
    for (I k = mesh->unknowns; k < n_by; k++) now->hub.at[k - mesh->unknowns] += by[k];
}

/* Straighten the axes that a step has led to; changes of all unknowns over it, before that. */
void arrive(const Mesh *mesh, const Moving *start, const Moving *now, D *out, I n_out) {
    moved_between(mesh, &start->pose, &now->pose, out);
    for (I k = mesh->unknowns; k < n_out; k++) {
        I own = k - mesh->unknowns;
        out[k] = now->hub.at[own] - start->hub.at[own];
    }
    straighten(&now->pose);
}
