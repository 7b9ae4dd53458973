/* What all files of the core share: numbers, tables that Python hands over, vectors.

   A table is a NamedTuple of ringsim.frame or ringsim.core in the order of its fields: an array is
   its address, its length and the numbers of each of its rows; see ringsim/core/library.py. */

#ifndef RINGSIM_CORE_H
#define RINGSIM_CORE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

typedef int64_t I;
typedef double D;

typedef struct {
    D *at;
    I n, each;
} Reals;

typedef struct {
    I *at;
    I n, each;
} Ints;

/* Four numbers, on which arithmetic works as on one.  Memory of numpy is not aligned to all four. */
enum { LANES = 4 };
typedef D V __attribute__((vector_size(32), aligned(8)));
typedef I Mask __attribute__((vector_size(32), aligned(8)));

static inline V all(D x) { return (V){x, x, x, x}; }

static inline bool any(Mask m) { return (m[0] | m[1] | m[2] | m[3]) != 0; }

static inline V take(const D *from) { return *(const V *)from; }

static inline void put(D *to, V x) { *(V *)to = x; }

static inline V size_of(V x) {
    const Mask rest = {INT64_MAX, INT64_MAX, INT64_MAX, INT64_MAX};
    return (V)((Mask)x & rest);
}

#define REAL D
#define VEC Vec
#define MAT Mat
#define OF(name) name
#include "vectors.h"
#undef REAL
#undef VEC
#undef MAT
#undef OF
#define REAL V
#define VEC Vec4
#define MAT Mat4
#define OF(name) name##4
#include "vectors.h"
#undef REAL
#undef VEC
#undef MAT
#undef OF

static inline Vec vector(const D *a) { return (Vec){a[0], a[1], a[2]}; }

static inline Mat matrix(const D *a) {
    Mat found;
    memcpy(found.a, a, sizeof found.a);
    return found;
}

/* The larger of two numbers; none if the first one is none. */
static inline D larger(D a, D b) { return a < b ? b : a; }

static inline void store(D *to, const Mat *m) { memcpy(to, m->a, sizeof m->a); }

static inline void store_vector(D *to, Vec a) { to[0] = a.x, to[1] = a.y, to[2] = a.z; }

static inline void add_vector(D *to, Vec a) { to[0] += a.x, to[1] += a.y, to[2] += a.z; }

/* A force and a moment on the six unknowns of a frame. */
static inline void push(D *to, Vec force, Vec moment) {
    add_vector(to, force);
    add_vector(to + 3, moment);
}

Mat turned(Vec a);
Mat turned_about_z(D angle);
Vec rotation_vector(const Mat *m);
Mat4 turned4(Vec4 a);
Vec4 rotation_vector4(const Mat4 *m);

/* ringsim.frame.mesh.Mesh */
typedef struct {
    Ints frame, angle;
    Reals axes;
    Ints point;
    Reals length, stiffness, mass, tau;
    Ints point_frame;
    Reals point_arm, point_mass;
    Ints home, angle_home, part, local, angle_local, frame_local, gone, size, spots, parent, up,
        fixed, craft;
    I unknowns;
} Mesh;

/* ringsim.frame.state */
typedef struct {
    Reals place, axes, angle;
} Pose;

typedef struct {
    Reals now, before, lead;
} Strains;

/* ringsim.frame.elimination */
typedef struct {
    Reals whole;
    Ints panels;
    Reals inverse;
    I columns;
} Fronts;

typedef struct {
    Reals columns, hub, moved, corner, alone;
    Ints pivots, used;
} Border;

/* Length (m) below which a span is none. */
static const D SHORTEST = 1e-9;

/* Places of used: columns in use, whether strings pull at the hub now, factors of the ropes, and hub's
   columns, the first ones: those of the last tangent, which may outlive the pull of its strings. */
enum { WIDE_USED, STRUNG, FACTORS, OF_HUB };

/* ringsim.core.chain.Seen */
typedef struct {
    Reals last;
    Ints back, stayed, begun;
} Seen;

/* ringsim.frame.laws */
typedef struct {
    Ints code, laws;
    Reals rows;
} Tape;

typedef struct {
    Tape tape;
    Ints own;
    Reals sense;
    I soft;
} Acting;

/* ringsim.frame.springs.Web */
typedef struct {
    Tape tape;
    Ints first, second;
    Reals natural;
    Ints ends, spots;
    D hub_mass;
} Web;

/* ringsim.frame.state */
typedef struct {
    D alpha_m, alpha_f, beta, gamma;
} Coefficients;

typedef struct {
    Reals place, rate, acceleration, auxiliary;
} Followed;

/* Where groups of followed coordinates begin. */
enum { POINTS, PATHS, ANGLES, ENDS, HUB, HUNG };

typedef struct {
    Pose pose;
    Reals hub;
    Followed followed;
    Strains strains;
} Moving;

typedef struct {
    Ints cuts, ends, hung, top, low;
    Reals reach;
    D stiffness;
    Reals damping;
    I weighs;
    Reals gravity;
} Held;

/* ringsim.frame.cables */
typedef struct {
    Ints frame;
    Reals arm, axes, swung;
    Ints angle;
    Reals share;
    Ints span, near, front, local;
} PathPoints;

typedef struct {
    Reals whole, swung, axis;
} Arms;

typedef struct {
    Tape decays, slopes;
    I moves, loads, most;
    D least_tension, solved;
} PulleyLaws;

/* ringsim.core.tension */
typedef struct {
    Ints starts, ends, near, pulley, felt, behind;
    Reals content, alive, material, slip_speed;
} RopeTable;

typedef struct {
    Reals natural, winding, inflow;
} Drums;

typedef struct {
    Reals length, rate, unit, angle, tension, share, exponent, speed;
} Spans;

/* ringsim.core.winches */
typedef struct {
    Ints on;
    I moves;
    Reals held, turned, paths, elapsed, began, past, balance, asked, limits, speeds, slopes, since, found,
        lengths, sliding, decays, seen, logs, told;
} Answering;

/* ringsim.frame.cables.Roped */
typedef struct {
    RopeTable ropes;
    Answering winches;
    Drums drums;
    Spans spans;
    Seen seen, drawn;
    Reals slopes, tight, left, pulls, changes, factors;
    Border border;
} Roped;

/* ringsim.frame.model.System */
typedef struct {
    Mesh mesh;
    PathPoints paths;
    Held held;
    Acting joints;
    Seen rubbing;
    Web web;
    Coefficients with;
    PulleyLaws laws;
    Arms arms;
    Fronts fronts;
    Reals loads, kept, lengths, weights, g, changes, reaction;
    I hub;
} System;

/* Length (m) and its rate (m/s) of the path along the spans of a rope. */
typedef struct {
    D length, rate;
} Path;

/* What is asked of Python: forces of parts that are not in the tables, how these change, and from
   LAWS on what laws of winches say. */
enum { FORCES, SLOPES, LAWS };
typedef I (*Ask)(I question);

/* Whether Python has answered.  What it returns if a signal strikes before it could begin is whatever
   lay in its place, as the last answer: each question has a number, and its complement answers it. */
static inline bool answered(Ask ask, I what) {
    static I count = 0;
    I question = (++count << 16) | what;
    return ask(question) == ~question;
}

/* How a balance ends.  RAISED: Python has not answered. */
enum { BALANCED, UNBALANCED, ENDLESS, PIVOT, ROPES, RAISED };

/* Number of a rope's cable, and whether the rope is at its beginning and at its end. */
typedef struct {
    I cable;
    bool begins, ends;
} Place;

static inline Mat axes_of(const Pose *pose, I frame) { return matrix(pose->axes.at + 9 * frame); }

static inline Vec place_of(const Pose *pose, I frame) { return vector(pose->place.at + 3 * frame); }

static inline D *front_of(const Fronts *fronts, I number) {
    return fronts->whole.at + number * fronts->whole.each;
}

static inline D *row_of(const Tape *tape, I row) { return tape->rows.at + row * tape->rows.each; }

void play(const Tape *tape);
void note_rates(const Seen *seen, const D *rates, I n);
D rate_across(const Seen *seen, I k);
D slope_between(const Seen *seen, I k, D rate, D own, D here, D there);
void place_points(const Mesh *mesh, const Pose *pose, D *out, I n_out);
void add_forces(const Mesh *mesh, const Pose *pose, const D *points, I n_points,
                const D *accelerations, I n_accelerations, const Strains *strains, D *loads,
                I n_loads, D *g, I n_g);
void begin_tangent(const Mesh *mesh, const Pose *pose, const D *points, I n_points,
                   const D *accelerations, I n_accelerations, const D *loads, I n_loads, D lead,
                   D by_place, const Fronts *fronts);
void place_paths(const PathPoints *paths, const Pose *pose, const Arms *arms, D *out);
void push_joints(const Acting *acting, const D *angles, const D *rates, const Mesh *mesh, D *g);
void add_joint_slopes(const Acting *acting, const D *angles, const D *rates, D by_rate,
                      const Mesh *mesh, const Fronts *fronts);
void note_joints(const Acting *acting, const Seen *rubbing, const D *rates);
void add_dry_slopes(const Acting *acting, const Seen *rubbing, const D *angles, const D *rates,
                    D by_rate, const Mesh *mesh, const Fronts *fronts);
D passing_joints(const Acting *acting, const D *angles, const D *rates, D *lost);
D passing_pairs(const Web *web, const Held *held, const Followed *now, D *lost, D *lengths, D *along);
D slid_apart(const Held *held, const Pose *pose, I n);
void energies_of(const Mesh *mesh, const D *velocities, I n_velocities, const D *strains,
                 I n_strains, D *out, I n_out);
bool balance(const Mesh *mesh, const PathPoints *paths, const Held *held, const Acting *joints,
             const Web *web, const Coefficients *coefficients, D step, const Followed *start,
             const Pose *pose, const D *hub, const Arms *arms, const Followed *now,
             const Strains *strains, D *loads, D *g, I size);
void differentiate(const Mesh *mesh, const Held *held, const Acting *joints, const Web *web,
                   const Pose *pose, const Followed *now, const D *loads, D lead, D by_rate,
                   D by_place, bool strung, const Fronts *fronts, const Border *border, I wide);
D measure(const RopeTable *ropes, const D *places, I n_places, const D *rates, I n_rates,
          const Spans *spans);
Place place_behind(const RopeTable *ropes, I rope, Place before);
D tension_of(const D *material, D natural, D winding, Path path);
void wind(const RopeTable *ropes, const D *wound, I n_wound, const D *rates, I n_rates, const Drums *drums);
void find_paths(const RopeTable *ropes, const Spans *spans, D *paths);
I turn_winches(const Answering *own, const RopeTable *ropes, Ask ask);
I find_left(const Answering *own, const RopeTable *ropes, Ask ask, D *left, I n);
D pull_cables(const System *system, const Roped *roped, const D *places, const D *rates, D *g);
void note_forces(const Roped *roped);
I find_slopes(const Roped *roped, const PulleyLaws *laws);
void move_paths(const PathPoints *paths, const Mesh *mesh, const Arms *arms, const D *x, I n, D *out);
void add_cables(const System *system, const Roped *roped, const D *rates, D rate_by_place, I count,
                I wide, I first);
void move(const Mesh *mesh, const Pose *pose, const D *step, I n_step);
bool factor(const Mesh *mesh, const Fronts *fronts);
void solve(const Mesh *mesh, const Fronts *fronts, D *x, I n_x);
void solve_one(const Mesh *mesh, const Fronts *fronts, D *x, I n_x);
void take_rows(const D *rows, I count, I size, const D *columns, I n, D *corner);
bool close_border(const System *system, const Roped *roped);
void cross_border(const System *system, const Roped *roped, D *x);

#endif
