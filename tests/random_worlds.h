/* random_worlds.h - small random worlds that use random subsets of what the library offers, and
   what must hold of each, whatever is used together. A world is told by a script, of numbers alone;
   the script is run several times, as it is and as a copy of itself:

       saved      saved and loaded between steps      the same hash after every step
       shared     work in random ranges and order     the same hash
       asked      queries, calls that must fail       the same hash; nothing changes at the call
       disturbed  lists rebuilt, steps refused for    the same bits, but for the time, which is
                  want of memory or too long          summed in other parts
       scaled     units that are powers of two        the same bits
       mirrored, turned by 90 degrees, added in       to rounding, as long as rounding does not
       another order                                  grow: measured by a run that is pushed a
   little

   and the run itself against sums: contact forces on every particle and wall, momentum, motion;
   and, of circles and half-planes, energies, see world_check_ledger.
   Ties, as of a box upright on a wall, end a comparison: the push decides them otherwise. Include
   it after dem2d.h and inside.h. */
#ifndef RANDOM_WORLDS_H
#define RANDOM_WORLDS_H

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "row_law.h"
#include "world_scene.h"

enum {
    MOST_MATERIALS = 3,
    MOST_SHAPES = 4,
    MOST_POINTS = 24,
    MOST_WALLS = 8,
    MOST_GRAINS = 9,
    MOST_EVENTS = 18, /* a third of them of the second kind: world_make_more */
    MOST_TURNS = 4,   /* points of a chain */
    MOST_TOLD = 200,  /* contact events of a step */
    MOST_STEPS = 24,
    WORLD_TAG = 5
};

/* --- features ----------------------------------------------------------------------------------
 */

enum {
    WITH_DASHPOT,
    WITH_ROLLING,
    WITH_SLIDING_DASHPOT,
    WITH_ROLLING_DASHPOT,
    WITH_LAW,
    WITH_TWO_POINTS,
    WITH_ONE_POINT,
    WITH_GJK,
    WITH_SERVO,
    WITH_MOVING,
    WITH_TURNED,
    WITH_SEGMENT,
    WITH_CHAIN,
    WITH_DRIVEN,
    WITH_FIXED,
    WITH_ADDED,
    WITH_REMOVED,
    WITH_MOVED,
    WITH_LOADS,
    WITH_WALLS,
    WITH_PAIR,
    WITH_TIME_STEP,
    WITH_GRAVITY,
    WITH_DAMPING,
    WITH_REFUSED,
    WITH_SKIN,
    WITH_LEDGER,
    WITH_LIST,
    WITH_MEMORY,
    WITH_SNAPSHOT,
    WITH_THREADS,
    WITH_QUERIES,
    WITH_GROUPS,
    WITH_SENSOR,
    WITH_EVENTS,
    WITH_CALLBACK, /* loads */
    WITH_ROWS,     /* written */
    WITH_RELAX,
    WITH_SHAPE, /* set_shape, with another template or another scale */
    WITH_SCALE,
    WITH_MATERIAL,
    WITH_POINTS, /* a chain as one wall */
    WITH_ONE_SIDED,
    WITH_TURNING,
    WITH_BELT,
    WITH_CELL,  /* periodic, */
    WITH_FLOW,  /* sheared or compressed, */
    WITH_HELD,  /* at stresses that are held */
    WITH_KINDS, /* of shapes, in the order of the library's types */
    WITH_COUNT = WITH_KINDS + DEM2D_SHAPE_TYPE_COUNT
};

static const char *const world_features[WITH_COUNT] = {
    "dashpot",   "rolling",    "slide damper", "roll damper", "caller's law", "two points",
    "one point", "GJK, EPA",   "servo",        "moving",      "turned wall",  "segment",
    "chain",     "driven",     "fixed",        "added",       "removed",      "moved",
    "loads",     "walls come", "set_pair",     "time step",   "gravity",      "damping",
    "refused",   "skin",       "ledger",       "new list",    "no memory",    "snapshot",
    "threads",   "queries",    "groups",       "sensor",      "events",       "load calls",
    "rows",      "relax",      "set_shape",    "set scale",   "set_material", "chain wall",
    "one-sided", "turning",    "belt",         "cell",        "flow",         "held",
    "circle",    "ellipse",    "polygon",      "polybezier",  "Fourier",      "custom"};

/* --- sizes: of radii and forces of 1 -----------------------------------------------------------
 */

/* A push, above all rounding; where rounding has grown to chaos there is nothing to compare. */
#define WORLD_PUSH 1e-12
#define WORLD_CHAOS 1e-6
/* Of curved shapes a search stops on the depth, to WORLD_TOLERANCE: the normal is then right to the
   root of that. */
#define WORLD_TOLERANCE 1e-13
#define WORLD_SEARCHED 3e-7

/* --- scripts -----------------------------------------------------------------------------------
 */

/* True once in so many times. */
static bool world_once_in(uint64_t *r, int count) {
    return random_below(r, count) == 0;
}

/* A shape by its numbers. */
typedef struct world_shape {
    int type, count;
    double size[2], rounding; /* circle, ellipse, custom; polygon */
    dem2d_vec points[MOST_POINTS];
    double a[6], b[6];
} world_shape;

/* What the caller does before a step. Objects are named by their place in the script. */
enum {
    EVENT_ADD, /* particle `which` comes */
    EVENT_REMOVE,
    EVENT_MOVE,
    EVENT_LOAD,
    EVENT_DRIVE,
    EVENT_ADD_WALL,
    EVENT_SET_WALL,
    EVENT_REMOVE_WALL,
    EVENT_PAIR,
    EVENT_GRAVITY,
    EVENT_DAMPING,
    EVENT_TIME_STEP,
    EVENT_REFUSED, /* a step that is too long, maybe without rolling friction, is refused */
    EVENT_MORE,    /* of world_make_more: */
    EVENT_GROUPS = EVENT_MORE,
    EVENT_SCALE,
    EVENT_SHAPE,
    EVENT_MATERIAL,
    EVENT_ROWS, /* velocities and loads of all that are free */
    EVENT_RELAX,
    EVENT_DRIVE_WALL,
    EVENT_DEFORM, /* of world_make_cell */
    EVENT_KINDS
};

typedef struct world_event {
    int kind, step, which, other;
    dem2d_vec at; /* place, velocity, gravity */
    double angle, number, more;
    dem2d_motion motion;
    dem2d_pair_desc pair;
    dem2d_wall_desc wall;
    dem2d_vec turns[MOST_TURNS]; /* of the wall, if it is a chain */
    dem2d_groups groups;
    dem2d_deformation_desc flow;
} world_event;

/* Ids in descriptions are places in the script; generation 1 says that there is one. */
typedef struct world_script {
    dem2d_world_desc desc; /* without callbacks */
    bool law;
    double exact; /* how near results are to those of a mirror image or in another order */
    dem2d_material_desc materials[MOST_MATERIALS];
    world_shape shapes[MOST_SHAPES];
    dem2d_wall_desc walls[MOST_WALLS]; /* points: in the next */
    dem2d_vec turns[MOST_WALLS][MOST_TURNS];
    double drag; /* of the callback of loads: N s/m; 0: there is none */
    dem2d_particle_desc grains[MOST_GRAINS];
    world_event events[MOST_EVENTS];
    int material_count, shape_count, wall_count, grain_count, event_count, steps;
    int walls_at_first, grains_at_first;
    uint64_t seed; /* of what the runs choose */
} world_script;

static world_shape world_make_polygon(uint64_t *r) {
    world_shape s = {.type = DEM2D_POLYGON};
    const double flat = random_between(r, 0.5, 1), phase = random_between(r, 0, 6);
    s.count = 3 + random_below(r, 5);
    if (world_once_in(r, 2)) s.rounding = random_between(r, 0.05, 0.3);
    for (int i = 0; i < s.count; i++) {
        const double angle =
            phase + 6.283185307179586 * (i + random_between(r, -0.2, 0.2)) / s.count;
        s.points[i] = vec(cos(angle), flat * sin(angle));
    }
    if (!world_once_in(r, 3)) return s;
    s.count = 4; /* a box, by exact numbers */
    for (int i = 0; i < 4; i++)
        s.points[i] = vec(i == 1 || i == 2 ? 0.75 : -0.75, i < 2 ? -0.5 : 0.5);
    return s;
}

/* A box of straight arcs with round corners, or an oval of four arcs. */
static world_shape world_make_bezier(uint64_t *r) {
    static const signed char box[MOST_POINTS][2] = {
        {-3, -5}, {-1, -5}, {1, -5}, {3, -5}, {4, -5},  {5, -4},  {5, -3},  {5, -1},
        {5, 1},   {5, 3},   {5, 4},  {4, 5},  {3, 5},   {1, 5},   {-1, 5},  {-3, 5},
        {-4, 5},  {-5, 4},  {-5, 3}, {-5, 1}, {-5, -1}, {-5, -3}, {-5, -4}, {-4, -5}};
    static const signed char axis[5][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 0}};
    const double x = random_between(r, 0.1, 0.2), y = random_between(r, 0.1, 0.2);
    world_shape s = {.type = DEM2D_BEZIER};
    double reach[5];
    s.count = world_once_in(r, 2) ? 8 : 4;
    for (int i = 0; i < 4; i++) reach[i] = random_between(r, 0.6, 1.1);
    reach[4] = reach[0];
    for (int i = 0; i < MOST_POINTS && s.count == 8; i++)
        s.points[i] = vec(x * box[i][0], y * box[i][1]);
    for (int i = 0; i < 4 && s.count == 4; i++) {
        const signed char *p = axis[i], *q = axis[i + 1];
        const double a = reach[i], b = reach[i + 1], h = 0.55;
        s.points[3 * i] = vec(a * p[0], a * p[1]);
        s.points[3 * i + 1] = vec(a * p[0] + h * b * q[0], a * p[1] + h * b * q[1]);
        s.points[3 * i + 2] = vec(b * q[0] + h * a * p[0], b * q[1] + h * a * p[1]);
    }
    return s;
}

static world_shape world_make_shape(uint64_t *r, int type) {
    world_shape s = {.type = type};
    if (type == DEM2D_POLYGON) return world_make_polygon(r);
    if (type == DEM2D_BEZIER) return world_make_bezier(r);
    s.size[0] = random_between(r, 0.5, 1);
    s.size[1] = type == DEM2D_CUSTOM ? 0.5 : random_between(r, 0.5, 1);
    if (type == DEM2D_CUSTOM) s.size[0] = 0.5;
    s.count = 4;
    s.a[0] = 1.6;
    for (int n = 2; n <= s.count && type == DEM2D_FOURIER; n++) {
        const double most = 0.4 / (s.count * (n * n - 1));
        s.a[n] = random_between(r, -most, most);
        s.b[n] = random_between(r, -most, most);
    }
    return s;
}

static dem2d_pair_desc world_make_pair(uint64_t *r) {
    dem2d_pair_desc pair;
    memset(&pair, 0, sizeof pair);
    pair.normal_stiffness = random_between(r, 1e4, 4e4);
    if (!world_once_in(r, 4)) pair.tangential_stiffness = random_between(r, 5e3, 2e4);
    if (!world_once_in(r, 4)) pair.friction = random_between(r, 0.1, 1);
    if (world_once_in(r, 3)) pair.damping_ratio = random_between(r, 0.05, 0.5);
    if (world_once_in(r, 3)) pair.rolling_friction = random_between(r, 0.05, 0.3);
    uint64_t random = *r * 0x9e3779b97f4a7c15u + 13, *own = &random; /* as world_make_more */
    if (world_once_in(own, 3)) pair.tangential_damping_ratio = random_between(own, 0.05, 0.5);
    if (world_once_in(own, 3)) pair.rolling_damping_ratio = random_between(own, 0.05, 0.5);
    return pair;
}

static dem2d_material_desc world_make_material(uint64_t *r) {
    const dem2d_pair_desc pair = world_make_pair(r);
    dem2d_material_desc m;
    memset(&m, 0, sizeof m);
    m.density = random_between(r, 0.8, 1.2);
    m.normal_stiffness = pair.normal_stiffness;
    m.tangential_stiffness = pair.tangential_stiffness;
    m.friction = pair.friction;
    m.damping_ratio = pair.damping_ratio;
    m.rolling_friction = pair.rolling_friction;
    m.tangential_damping_ratio = pair.tangential_damping_ratio;
    m.rolling_damping_ratio = pair.rolling_damping_ratio;
    return m;
}

static dem2d_material_id world_material(uint64_t *r, const world_script *s) {
    dem2d_material_id id;
    id.index = (uint32_t)random_below(r, s->material_count);
    id.generation = 1;
    return id;
}

/* Grains on a lattice, most of them touching their neighbours; some upright, some deep in others or
   behind the floor. */
static dem2d_particle_desc world_make_grain(uint64_t *r, const world_script *s, int place) {
    dem2d_particle_desc g;
    memset(&g, 0, sizeof g);
    g.scale = world_once_in(r, 3) ? 1 : random_between(r, 0.8, 1.2);
    g.shape.index = (uint32_t)random_below(r, s->shape_count);
    g.material = world_material(r, s);
    g.motion = world_once_in(r, 6) ? DEM2D_FIXED : world_once_in(r, 6) ? DEM2D_DRIVEN : DEM2D_FREE;
    g.position.x = 1.5 * (place % 3) + random_between(r, -0.15, 0.15);
    g.position.y = 0.7 + 1.45 * (double)(place / 3) + random_between(r, -0.15, 0.15);
    const bool deep = world_once_in(r, 8), upright = world_once_in(r, 4);
    if (deep) g.position.y -= random_between(r, 0.5, 6);
    g.angle = random_between(r, -4, 4);
    if (upright) g.angle = 0;
    if (g.motion == DEM2D_FIXED) return g;
    g.velocity = vec(random_between(r, -2, 2), random_between(r, -2, 2));
    g.angular_velocity = world_once_in(r, 3) ? 0 : random_between(r, -2, 2);
    return g;
}

static dem2d_wall_desc world_make_wall(uint64_t *r, const world_script *s, double x, double y,
                                       double nx, double ny) {
    dem2d_wall_desc w;
    memset(&w, 0, sizeof w);
    w.material = world_material(r, s);
    w.point = vec(x, y);
    w.normal = vec(nx, ny);
    w.length = 3;
    w.stress = random_between(r, 100, 1000);
    w.max_speed = random_between(r, 0.1, 2);
    if (!world_once_in(r, 4)) return w;
    w.mode = world_once_in(r, 2) ? DEM2D_WALL_MOVING : DEM2D_WALL_SERVO;
    w.velocity = vec(random_between(r, -1, 1), random_between(r, -1, 1));
    return w;
}

static dem2d_wall_desc world_make_segment(uint64_t *r, const world_script *s, dem2d_vec from,
                                          dem2d_vec to) {
    dem2d_wall_desc w = world_make_wall(r, s, from.x, from.y, 0, 0);
    w.segment = true;
    w.end = to;
    if (world_once_in(r, 3)) w.point = to, w.end = from;
    return w;
}

/* A floor, of segments or a half-plane; sides, of which one may be a segment; a lid, whose length
   may be the distance of the sides. */
static void world_make_walls(uint64_t *r, world_script *s) {
    const double tilt = world_once_in(r, 3) ? 0 : random_between(r, -0.2, 0.2);
    if (world_once_in(r, 2)) {
        s->walls[s->wall_count++] = world_make_wall(r, s, 0, 0, -tilt, 1);
    } else {
        const int links = 1 + random_below(r, 3);
        dem2d_vec from = vec(-1.5, random_between(r, -0.2, 0.2));
        for (int i = 0; i < links; i++) {
            const dem2d_vec to = vec(-1.5 + 6.0 * (i + 1) / links,
                                     world_once_in(r, 3) ? from.y : random_between(r, -0.3, 0.3));
            s->walls[s->wall_count++] = world_make_segment(r, s, from, to);
            from = to;
        }
    }
    const int left = s->wall_count;
    s->walls[s->wall_count++] = world_make_wall(r, s, -0.7, 0, 1, random_between(r, -0.1, 0.1));
    s->walls[s->wall_count++] = world_make_wall(r, s, 3.7, 0, -1, 0);
    s->walls[s->wall_count] = world_make_wall(r, s, 0, 4.2, 0, -1);
    const bool spans = world_once_in(r, 2);
    for (int i = 0; i < 2 && spans; i++) {
        s->walls[s->wall_count].spans[i].index = (uint32_t)(left + i);
        s->walls[s->wall_count].spans[i].generation = 1;
    }
    s->wall_count++;
    s->walls_at_first = s->wall_count;
    if (s->wall_count == MOST_WALLS) return;
    s->walls[s->wall_count++] = /* comes later, if it is called for */
        world_make_segment(r, s, vec(random_between(r, 0, 1), random_between(r, 1, 2)),
                           vec(random_between(r, 2, 3), random_between(r, 1, 2)));
}

/* A wall as it is described, or a little elsewhere, turned, or of another kind. */
static dem2d_wall_desc world_change_wall(uint64_t *r, const world_script *s, int which) {
    dem2d_wall_desc w = s->walls[which];
    const double way = world_once_in(r, 2) ? 1e-3 : 0.05;
    const dem2d_vec move = vec(random_between(r, -way, way), random_between(r, -way, way));
    w.point.x += move.x, w.point.y += move.y;
    w.end.x += move.x, w.end.y += move.y;
    if (world_once_in(r, 3)) w.end.y += random_between(r, -0.01, 0.01);
    if (world_once_in(r, 3)) w.normal.x += random_between(r, -0.01, 0.01);
    if (world_once_in(r, 3)) w.material = world_material(r, s);
    if (world_once_in(r, 3)) w.mode = (dem2d_wall_mode)random_below(r, 3);
    return w;
}

static void world_make_event(uint64_t *r, const world_script *s, world_event *e) {
    memset(e, 0, sizeof *e);
    e->kind = random_below(r, EVENT_MORE);
    e->step = random_below(r, s->steps);
    e->which = random_below(r, s->grain_count);
    e->other = random_below(r, s->material_count);
    e->at = vec(random_between(r, -2, 2), random_between(r, -2, 2));
    e->angle = random_between(r, -3, 3);
    e->number = random_between(r, 0, 0.5);
    e->more = random_between(r, 0, 2);
    e->motion = (dem2d_motion)random_below(r, 3);
    e->pair = world_make_pair(r);
    if (e->kind == EVENT_ADD && world_once_in(r, 2)) e->which = s->grain_count - 1;
    if (e->kind == EVENT_MOVE) e->at = vec(e->at.x + 1.5, e->at.y + 2);
    if (e->kind == EVENT_GRAVITY) e->at = vec(5 * e->at.x, -10 + e->at.y);
    if (e->kind == EVENT_PAIR || e->kind == EVENT_REFUSED)
        e->which = random_below(r, s->material_count);
    if (e->kind >= EVENT_ADD_WALL && e->kind <= EVENT_REMOVE_WALL) {
        e->which = random_below(r, s->wall_count);
        e->wall = world_change_wall(r, s, e->which);
    }
    if (e->kind == EVENT_TIME_STEP) e->number = random_between(r, 0.5, 1.5) * s->desc.time_step;
}

/* Into the order of steps. */
static void world_add_event(world_script *s, const world_event *e) {
    int k = s->event_count++;
    for (; k > 0 && s->events[k - 1].step > e->step; k--) s->events[k] = s->events[k - 1];
    s->events[k] = *e;
}

static void world_make_events(uint64_t *r, world_script *s) {
    const int count = world_once_in(r, 3) ? 0 : 1 + random_below(r, 2 * MOST_EVENTS / 3);
    for (int i = 0; i < count; i++) {
        world_event e;
        world_make_event(r, s, &e);
        world_add_event(s, &e);
    }
}

/* --- more of it --------------------------------------------------------------------------------
   From a sequence of its own, so that the worlds of a seed keep what they have. */

static dem2d_groups world_make_groups(uint64_t *r) {
    dem2d_groups g;
    memset(&g, 0, sizeof g);
    if (!world_once_in(r, 3)) g.category = 1u << random_below(r, 3);
    if (world_once_in(r, 2)) g.mask = 7u & ~(1u << random_below(r, 3));
    g.sensor = world_once_in(r, 6);
    return g;
}

/* A floor of three points, or a paddle of three that turns: in place of wall k. */
static void world_make_chain(uint64_t *r, world_script *s, int k, bool floor) {
    static const dem2d_vec flat[3] = {{-1.5, 0}, {1.5, 0}, {4.5, 0}};
    static const dem2d_vec paddle[3] = {{1, 1.5}, {2.2, 1.4}, {1.6, 2.2}};
    dem2d_wall_desc *w = &s->walls[k];
    w->segment = false, w->count = 3, w->closed = !floor;
    w->mode = DEM2D_WALL_STILL, w->velocity = vec(0, 0);
    for (int i = 0; i < 3; i++) {
        const dem2d_vec p = floor ? flat[i] : paddle[i];
        s->turns[k][i] =
            vec(p.x + random_between(r, -0.1, 0.1), p.y + random_between(r, -0.2, 0.2));
    }
    w->one_sided = floor && world_once_in(r, 2);
    w->pivot = vec(1.6, floor ? 0 : 1.7);
    if (world_once_in(r, 2)) return;
    w->mode = DEM2D_WALL_MOVING;
    w->velocity = vec(random_between(r, -0.5, 0.5), random_between(r, -0.5, 0.5));
    w->angular_velocity = random_between(r, -1, 1);
}

/* Chains where they have room, belts, walls of groups, sensors. */
static void world_make_more_walls(uint64_t *r, world_script *s) {
    if (!s->walls[0].segment && world_once_in(r, 3)) world_make_chain(r, s, 0, true);
    const int last = s->wall_count - 1;
    if (last >= s->walls_at_first && world_once_in(r, 3)) {
        world_make_chain(r, s, last, false);
        if (world_once_in(r, 2)) s->walls_at_first = s->wall_count;
    }
    for (int k = 0; k < s->wall_count; k++) {
        dem2d_wall_desc *w = &s->walls[k];
        w->user_data = random_bits(r);
        if (w->segment && w->mode == DEM2D_WALL_STILL && world_once_in(r, 4)) w->one_sided = true;
        if (w->mode == DEM2D_WALL_STILL && world_once_in(r, 6))
            w->surface_speed = random_between(r, -1, 1);
        if (s->seed >> 8 & 1 && world_once_in(r, 3)) w->groups = world_make_groups(r);
        if (w->mode == DEM2D_WALL_SERVO) w->groups.sensor = false;
    }
}

/* A wall event is of the wall as it has become. */
static void world_renew_wall_events(uint64_t *r, world_script *s) {
    for (int i = 0; i < s->event_count; i++) {
        world_event *e = &s->events[i];
        if (e->kind < EVENT_ADD_WALL || e->kind > EVENT_REMOVE_WALL) continue;
        e->wall = world_change_wall(r, s, e->which);
        if (e->wall.groups.sensor) e->wall.mode = s->walls[e->which].mode;
        if (e->wall.count == 0 && !e->wall.one_sided) {
            if (e->wall.mode != DEM2D_WALL_STILL) e->wall.surface_speed = 0;
            continue;
        }
        const double way = random_between(r, -0.02, 0.02);
        e->wall.mode = s->walls[e->which].mode;
        for (int k = 0; k < MOST_TURNS; k++)
            e->turns[k] = vec(s->turns[e->which][k].x + way, s->turns[e->which][k].y);
    }
}

static void world_make_more_event(uint64_t *r, const world_script *s, world_event *e) {
    memset(e, 0, sizeof *e);
    e->kind = EVENT_MORE + random_below(r, EVENT_DEFORM - EVENT_MORE);
    e->step = random_below(r, s->steps);
    e->which = random_below(r, s->grain_count);
    e->other = random_below(r, e->kind == EVENT_SHAPE ? s->shape_count : s->material_count);
    e->groups = world_make_groups(r);
    e->number = random_between(r, 0.98, 1.02);
    e->at = vec(random_between(r, -1, 1), random_between(r, -1, 1));
    e->angle = random_between(r, -1, 1);
    e->more = random_between(r, 0.05, 0.5);
    if (e->kind == EVENT_DRIVE_WALL) e->which = random_below(r, s->wall_count);
}

/* Half of the worlds have more, of random subsets. */
static void world_make_more(world_script *s) {
    uint64_t random = s->seed * 0x9e3779b97f4a7c15u + 7, *r = &random;
    if (s->seed >> 4 & 1) return;
    world_make_more_walls(r, s);
    world_renew_wall_events(r, s);
    if (s->seed >> 5 & 1) s->drag = random_between(r, 0.1, 3);
    for (int i = 0; i < s->grain_count; i++) {
        s->grains[i].user_data = random_bits(r);
        if (s->seed >> 6 & 1 && world_once_in(r, 2)) s->grains[i].groups = world_make_groups(r);
    }
    const int more = s->seed >> 7 & 1 ? random_below(r, MOST_EVENTS / 3 + 1) : 0;
    for (int i = 0; i < more; i++) {
        world_event e;
        world_make_more_event(r, s, &e);
        world_add_event(s, &e);
    }
}

/* Rates or stresses, of a cell that is periodic in both directions. */
static dem2d_deformation_desc world_make_flow(uint64_t *r) {
    dem2d_deformation_desc flow;
    memset(&flow, 0, sizeof flow);
    flow.hold_xx = world_once_in(r, 4), flow.hold_yy = world_once_in(r, 4);
    flow.hold_yx = world_once_in(r, 4);
    if (flow.hold_xx) flow.stress_xx = random_between(r, 100, 1000);
    if (flow.hold_yy) flow.stress_yy = random_between(r, 100, 1000);
    if (flow.hold_yx) flow.stress_yx = random_between(r, -100, 100);
    if (!flow.hold_xx && world_once_in(r, 2)) flow.xx = random_between(r, -1, 1);
    if (!flow.hold_yy && world_once_in(r, 2)) flow.yy = random_between(r, -1, 1);
    if (!flow.hold_yx && world_once_in(r, 2)) flow.xy = random_between(r, -20, 20);
    return flow;
}

/* A floor that goes round the cell, in place of a half-plane: a chain whose end is its start one
   period further. */
static void world_make_round(uint64_t *r, world_script *s, int k, double period) {
    dem2d_wall_desc *w = &s->walls[k];
    const double start = random_between(r, -3, 3), flat = random_below(r, 2);
    w->mode = world_once_in(r, 3) ? DEM2D_WALL_MOVING : DEM2D_WALL_STILL;
    w->velocity = vec(0, 0);
    if (w->mode == DEM2D_WALL_MOVING)
        w->velocity = vec(random_between(r, -1, 1), random_between(r, -0.2, 0.2));
    w->count = 2 + random_below(r, 3), w->one_sided = world_once_in(r, 3);
    for (int i = 0; i < w->count; i++) {
        s->turns[k][i].x = start + i * period / (w->count - 1);
        s->turns[k][i].y = flat * random_between(r, -0.15, 0.15);
    }
    s->turns[k][w->count - 1].y = s->turns[k][0].y;
}

/* A triangle or a segment among the grains of a cell, that stands still, moves or turns. */
static void world_make_obstacle(uint64_t *r, world_script *s, double size) {
    const int k = s->wall_count++;
    const dem2d_vec at = vec(random_between(r, 3, 6), random_between(r, 0.4, 4));
    dem2d_wall_desc *w = &s->walls[k];
    *w = world_make_wall(r, s, at.x, at.y, 0, 0);
    if (w->mode == DEM2D_WALL_SERVO) w->mode = DEM2D_WALL_MOVING;
    w->pivot = vec(at.x + random_between(r, -1, 1), at.y);
    if (w->mode == DEM2D_WALL_MOVING) w->angular_velocity = random_between(r, -2, 2);
    const double turn = random_between(r, 0, 6);
    w->count = 2 + random_below(r, 2), w->closed = w->count == 3;
    w->one_sided = world_once_in(r, 4);
    if (w->mode == DEM2D_WALL_STILL && world_once_in(r, 3))
        w->surface_speed = random_between(r, -1, 1);
    for (int i = 0; i < w->count; i++) {
        s->turns[k][i].x = at.x + size * cos(turn + 2 * i);
        s->turns[k][i].y = at.y + size * sin(turn + 2 * i);
    }
    s->walls_at_first = s->wall_count;
}

/* Walls that a cell can have: along x a floor and a lid, and an obstacle. */
static void world_make_cell_walls(uint64_t *r, world_script *s, double height, double period) {
    s->wall_count = s->walls_at_first = height > 0 ? 2 : 0;
    for (int k = 0; k < s->wall_count; k++) {
        const double up = k == 0 ? 1 : -1;
        s->walls[k] = world_make_wall(r, s, 0, k * height, 0, up);
        if (s->walls[k].mode == DEM2D_WALL_STILL && world_once_in(r, 3))
            s->walls[k].surface_speed = random_between(r, -1, 1);
    }
    if (height > 0 && world_once_in(r, 2)) world_make_round(r, s, 0, period);
    if (world_once_in(r, 2)) world_make_obstacle(r, s, period > 3 ? 0.5 : 0.2);
    for (int i = 0; i < s->event_count; i++) {
        world_event *e = &s->events[i];
        const bool wall = (e->kind >= EVENT_ADD_WALL && e->kind <= EVENT_REMOVE_WALL) ||
                          e->kind == EVENT_DRIVE_WALL;
        if (wall && s->wall_count == 0) e->kind = EVENT_GRAVITY;
        if (!wall || s->wall_count == 0) continue;
        const double up = random_between(r, -0.05, 0.05);
        e->which %= s->wall_count;
        e->wall = s->walls[e->which];
        e->wall.point.y += up;
        memcpy(e->turns, s->turns[e->which], sizeof e->turns);
        for (int k = 0; k < e->wall.count; k++) e->turns[k].y += up;
    }
}

/* Some worlds are in a cell: periodic in both directions, or along x between two half-planes; a
   small one, in which grains touch images of themselves; at rest or deformed, also so that its
   vector b changes. */
static void world_make_cell(world_script *s) {
    uint64_t random = s->seed * 0x9e3779b97f4a7c15u + 11, *r = &random;
    const int kind = random_below(r, 3), rows = (s->grain_count + 2) / 3;
    dem2d_cell *cell = &s->desc.cell;
    if ((s->seed >> 12 & 7) != 1) return;
    cell->origin = vec(random_between(r, -1, 1), 0);
    cell->a.x = random_between(r, 4.3, 5);
    const double height = 1.45 * rows + random_between(r, -0.1, 0.5);
    if (kind == 2) {
        s->grain_count = s->grains_at_first = 1 + random_below(r, 2);
        cell->a.x = random_between(r, 1.5, 2.5);
        for (int i = 0; i < s->event_count; i++) s->events[i].which %= s->material_count;
        for (int i = 0; i < s->event_count; i++)
            if (s->events[i].which >= s->grain_count) s->events[i].which = 0;
    }
    world_make_cell_walls(r, s, kind == 1 ? height : 0, cell->a.x);
    if (kind == 1) return;
    cell->b.y = kind == 2 ? random_between(r, 1.5, 2.5) : height;
    cell->b.x = world_once_in(r, 2) ? 0 : random_between(r, -0.5, 0.5) * cell->a.x;
    if (world_once_in(r, 4)) cell->b.x = 0.499 * cell->a.x;
    for (int i = 0; i < 3 && s->event_count < MOST_EVENTS; i++) {
        world_event e;
        memset(&e, 0, sizeof e);
        e.kind = EVENT_DEFORM;
        if (i > 0) e.step = random_below(r, s->steps);
        e.flow = world_make_flow(r);
        if (s->wall_count > 0) { /* no stress is held with walls */
            e.flow.hold_xx = e.flow.hold_yx = e.flow.hold_yy = false;
            e.flow.stress_xx = e.flow.stress_yx = e.flow.stress_yy = 0;
        }
        if (!world_once_in(r, 3)) world_add_event(s, &e);
    }
}

/* The script of a seed and an index. */
static void world_make_script(uint64_t seed, int64_t index, world_script *s) {
    uint64_t random = seed * 0xd1342543de82ef95u + (uint64_t)index, *r = &random;
    const bool round = world_once_in(r, 6), sharp = world_once_in(r, 3);
    memset(s, 0, sizeof *s);
    s->seed = random_bits(r);
    s->steps = 6 + random_below(r, MOST_STEPS - 5);
    s->desc.time_step = random_between(r, 2e-4, 1.5e-3);
    s->desc.gravity.y = world_once_in(r, 4) ? 0 : -9.81;
    if (world_once_in(r, 3)) s->desc.local_damping = random_between(r, 0, 0.7);
    if (world_once_in(r, 4)) s->desc.global_damping = random_between(r, 0, 2);
    if (world_once_in(r, 4)) s->desc.skin = random_between(r, 0.001, 0.3);
    if (world_once_in(r, 8)) s->desc.solver = DEM2D_GJK_EPA;
    if (world_once_in(r, 8)) s->desc.faces = DEM2D_ONE_POINT;
    s->desc.skip_time_step_check = world_once_in(r, 4);
    s->desc.ledger = world_once_in(r, 2);
    s->desc.contact_tolerance = WORLD_TOLERANCE;
    if (s->seed & 1) s->desc.event_capacity = 20; /* without another random number */
    s->law = world_once_in(r, 8);
    s->material_count = 1 + random_below(r, MOST_MATERIALS);
    s->shape_count = 1 + random_below(r, MOST_SHAPES);
    s->grain_count = 2 + random_below(r, MOST_GRAINS - 1);
    s->exact = WORLD_PUSH;
    if (s->desc.solver == DEM2D_GJK_EPA) s->exact = WORLD_SEARCHED;
    for (int i = 0; i < s->material_count; i++) s->materials[i] = world_make_material(r);
    for (int i = 0; i < s->shape_count; i++) {
        int type = random_below(r, DEM2D_SHAPE_TYPE_COUNT);
        if (sharp) type = world_once_in(r, 4) ? DEM2D_CIRCLE : DEM2D_POLYGON;
        if (round) type = DEM2D_CIRCLE;
        s->shapes[i] = world_make_shape(r, type);
        if (type != DEM2D_CIRCLE && type != DEM2D_POLYGON)
            s->exact = fmax(s->exact, WORLD_SEARCHED);
    }
    for (int i = 0; i < s->grain_count; i++) s->grains[i] = world_make_grain(r, s, i);
    s->grains_at_first = s->grain_count - random_below(r, 3) / 2;
    world_make_walls(r, s);
    world_make_events(r, s);
    for (int i = 0; i < s->grain_count && (s->seed & 2); i++) /* names that are in no order */
        s->grains[i].name = (uint64_t)(i + 1) * 0x9E3779B97F4A7C15u;
    world_make_more(s);
    world_make_cell(s);
}

static bool world_in_cell(const world_script *s) {
    return s->desc.cell.a.x > 0;
}

/* --- runs --------------------------------------------------------------------------------------
 */

/* How a run tells its script: first the units, then a reflection, then a quarter turn. */
typedef struct world_view {
    const char *name;
    int length, mass, time; /* powers of two */
    bool mirrored, turned, reordered;
    bool saved, shared, asked, disturbed, sums;
    double push; /* of places, relative to the grains */
} world_view;

/* Of a custom shape, a circle moved along a line: radius, half the line, and which axis it is on.
 */
typedef struct world_stadium {
    double radius, half;
    int upright;
    dem2d_custom_desc desc;
} world_stadium;

/* What was seen after a step, in the units and the directions of the script. Numbers are over their
   sizes: places over a radius, velocities over that and the time of a contact, forces over a
   stiffness and a radius. What is not there is 0. */
enum { GRAIN_NUMBERS = 10, WALL_NUMBERS = 6, ENERGY_NUMBERS = 6 };
typedef struct world_sight {
    double grain[MOST_GRAINS][GRAIN_NUMBERS]; /* x y c s vx vy w fx fy torque */
    double wall[MOST_WALLS][WALL_NUMBERS];    /* x y vx vy fx fy */
    double energy[ENERGY_NUMBERS];
    uint64_t hash;
    dem2d_result result; /* of the step */
} world_sight;

typedef struct world_run {
    const world_script *script;
    world_view view;
    dem2d_world *world;
    uint64_t random; /* of what this run chooses */
    dem2d_material_id materials[MOST_MATERIALS];
    dem2d_shape_id shapes[MOST_SHAPES];
    dem2d_particle_id grains[MOST_GRAINS]; /* generation 0: not there */
    dem2d_wall_id walls[MOST_WALLS];
    double time_step, local_damping,
        global_damping;  /* as they are set now, in the script's units */
    double longest_step; /* that was made */
    dem2d_vec gravity;
    dem2d_vec turns[MOST_TURNS]; /* of the wall that is set */
    world_stadium stadium;
    int fail_at, blocks; /* allocations until one fails, 0: none does; in use */
    char *fault;         /* the first thing that does not hold */
    uint64_t *features;  /* that were met */
    bool deformed;       /* the cell flows, or has done so */
    bool spoiled;        /* a step that should have been refused was taken: all flies apart */
} world_run;

enum { FAULT_ROOM = 256 };

/* Only the first counts. */
static void world_fault(world_run *run, const char *format, ...) {
    if (run->fault[0] != 0) return;
    va_list list;
    va_start(list, format);
    vsnprintf(run->fault, FAULT_ROOM, format, list);
    va_end(list);
}

static void world_met(world_run *run, int feature) {
    *run->features |= (uint64_t)1 << feature;
}

/* What the script holds to be possible. */
static void world_must(world_run *run, dem2d_result result, const char *what) {
    if (result != DEM2D_OK) world_fault(run, "%s: %s", what, dem2d_result_text(result));
}

static void *world_allocate(void *user, size_t size) {
    world_run *run = (world_run *)user;
    if (run->fail_at > 0 && --run->fail_at == 0) return NULL;
    run->blocks++;
    void *memory = malloc(size);
    if (memory != NULL) memset(memory, 0xa5, size); /* who relies on zeros is found */
    return memory;
}

static void world_release(void *user, void *memory, size_t size) {
    (void)size;
    if (memory != NULL) ((world_run *)user)->blocks--;
    free(memory);
}

/* Ranges of random lengths in a random order. */
static void world_parallel(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                           void *context) {
    world_run *run = (world_run *)user;
    int begin[64], end[64], ranges = 0;
    (void)phase;
    for (int at = 0; at < count; ranges++) {
        int length = 1 + random_below(&run->random, 3);
        if (ranges == 63 || length > count - at) length = count - at;
        begin[ranges] = at;
        end[ranges] = at += length;
    }
    for (; ranges > 0; ranges--) {
        const int k = random_below(&run->random, ranges);
        task(context, begin[k], end[k]);
        begin[k] = begin[ranges - 1];
        end[k] = end[ranges - 1];
    }
}

static dem2d_vec world_stadium_support(void *user, dem2d_vec u, double *rho) {
    const world_stadium *s = (const world_stadium *)user;
    dem2d_vec p = vec(s->radius * u.x, s->radius * u.y);
    if (s->upright)
        p.y += u.y >= 0 ? s->half : -s->half;
    else
        p.x += u.x >= 0 ? s->half : -s->half;
    if (rho != NULL) *rho = s->radius;
    return p;
}

static const dem2d_custom_desc *world_custom(void *user, int tag) {
    const world_run *run = (const world_run *)user;
    return tag == WORLD_TAG ? &run->stadium.desc : NULL;
}

/* A spring, a dashpot that may pull, friction, rolling drag. Without units of its own. */
static void world_law_row(void *user, const row_in *in, row_out *out) {
    const double spring = in->pair.normal_stiffness * in->depth;
    const double drag = 0.25 * sqrt(in->mass * in->pair.normal_stiffness);
    const double limit = in->pair.friction * spring;
    const double slid = in->pair.tangential_stiffness * (in->sliding * in->time_step);
    const double shear = in->tangential_force - slid;
    (void)user;
    out->normal_force = spring + drag * in->approach;
    out->tangential_force = shear > limit ? limit : shear < -limit ? -limit : shear;
    out->moment = -0.125 * drag * in->radius * (in->spin * in->radius);
    out->energy = spring * in->depth / 2;
    out->state[0] = in->state[0] + 1;
}

static void world_law(void *user, dem2d_law_batch *batch) {
    for_rows(user, batch, world_law_row);
}

/* A drag, as the script has it in its units. */
static void world_drag(void *user, dem2d_world *world) {
    world_run *run = (world_run *)user;
    const world_view *v = &run->view;
    const int fail_at = run->fail_at;
    run->fail_at = 0; /* it has no way to tell that there is no memory */
    const double drag = run->script->drag * ldexp(1, v->mass - v->time);
    for (int i = 0; i < run->script->grain_count; i += 2) {
        dem2d_particle_info p;
        if (run->grains[i].generation == 0) continue;
        if (dem2d_world_get_particle(world, run->grains[i], &p) != DEM2D_OK) continue;
        const dem2d_vec force = vec(-drag * p.velocity.x, -drag * p.velocity.y);
        world_must(run, dem2d_world_set_load(world, run->grains[i], force, 0), "load of a call");
    }
    run->fail_at = fail_at;
}

/* --- from the script to a view and back --------------------------------------------------------
 */

static double world_power(int exponent) {
    return ldexp(1, exponent);
}

/* A direction or a place, in other units. */
static dem2d_vec world_map(const world_view *v, dem2d_vec p, double unit) {
    if (v->mirrored) p.x = -p.x;
    if (v->turned) p = vec(-p.y, p.x);
    return vec(p.x * unit, p.y * unit);
}

/* And back. */
static dem2d_vec world_unmap(const world_view *v, dem2d_vec p, double unit) {
    p = vec(p.x / unit, p.y / unit);
    if (v->turned) p = vec(p.y, -p.x);
    if (v->mirrored) p.x = -p.x;
    return p;
}

static double world_sense(const world_view *v) {
    return v->mirrored ? -1 : 1;
}

/* A cell in other units: of a mirror image its corner and b are mirrored, but a is along x; back by
   1/unit. */
static dem2d_cell world_cell(const world_view *v, const dem2d_cell *cell, double unit) {
    dem2d_cell c = *cell;
    c.a.x *= unit;
    c.b = vec(c.b.x * unit * world_sense(v), c.b.y * unit);
    c.origin = vec(c.origin.x * unit * world_sense(v), c.origin.y * unit);
    return c;
}

static double world_length(const world_view *v) {
    return world_power(v->length);
}

static double world_speed(const world_view *v) {
    return world_power(v->length - v->time);
}

/* Of a stiffness: kg/m over s2, and of a stress, as forces are N/m. */
static double world_stiffness(const world_view *v) {
    return world_power(v->mass - 2 * v->time);
}

static double world_force(const world_view *v) {
    return world_power(v->mass + v->length - 2 * v->time);
}

static dem2d_pair_desc world_pair(const world_view *v, const dem2d_pair_desc *pair) {
    dem2d_pair_desc p = *pair;
    p.normal_stiffness *= world_stiffness(v);
    p.tangential_stiffness *= world_stiffness(v);
    return p;
}

/* h(t) becomes h(pi - t), or h(t - pi/2). */
static void world_map_series(const world_view *v, double *a, double *b, int count) {
    static const signed char cosine[4] = {1, 0, -1, 0}, sine[4] = {0, 1, 0, -1};
    for (int n = 0; n <= count; n++) {
        if (v->mirrored && n % 2 == 1) a[n] = -a[n];
        if (v->mirrored && n % 2 == 0) b[n] = -b[n];
        const double c = cosine[n % 4], s = sine[n % 4], old = a[n];
        if (v->turned) a[n] = old * c - b[n] * s, b[n] = old * s + b[n] * c;
        a[n] *= world_length(v), b[n] *= world_length(v);
    }
}

static dem2d_result world_create_custom(world_run *run, const world_shape *s, dem2d_shape **shape) {
    world_stadium *stadium = &run->stadium;
    stadium->radius = s->size[0] * world_length(&run->view);
    stadium->half = s->size[1] * world_length(&run->view);
    stadium->upright = run->view.turned;
    const double r = stadium->radius, h = stadium->half;
    memset(&stadium->desc, 0, sizeof stadium->desc);
    stadium->desc.support = world_stadium_support;
    stadium->desc.user = stadium;
    stadium->desc.rho_min = stadium->desc.inscribed = stadium->radius;
    stadium->desc.mass.area = 3.141592653589793 * r * r + 4 * r * h;
    stadium->desc.mass.polar_moment = 3.141592653589793 * r * r * (r * r / 2 + h * h) +
                                      8.0 / 3 * (h * r) * (r * r) +
                                      4.0 / 3 * (h * r) * (r * r + h * h);
    stadium->desc.tag = WORLD_TAG;
    return dem2d_shape_create_custom(NULL, &stadium->desc, shape);
}

static dem2d_result world_create_shape(world_run *run, const world_shape *s, dem2d_shape **shape) {
    const world_view *v = &run->view;
    const double unit = world_length(v), x = s->size[0] * unit, y = s->size[1] * unit;
    const int count = s->type == DEM2D_BEZIER ? 3 * s->count : s->count;
    dem2d_vec points[MOST_POINTS];
    double a[6], b[6];
    if (s->type == DEM2D_CIRCLE) return dem2d_shape_create_circle(NULL, x, shape);
    if (s->type == DEM2D_ELLIPSE)
        return dem2d_shape_create_ellipse(NULL, v->turned ? y : x, v->turned ? x : y, shape);
    if (s->type == DEM2D_CUSTOM) return world_create_custom(run, s, shape);
    for (int i = 0; s->type != DEM2D_FOURIER && i < count; i++) /* a mirror image goes back */
        points[i] = world_map(v, s->points[v->mirrored ? (count - i) % count : i], unit);
    if (s->type == DEM2D_POLYGON)
        return dem2d_shape_create_polygon(NULL, points, count, s->rounding * unit, shape);
    if (s->type == DEM2D_BEZIER) return dem2d_shape_create_bezier(NULL, points, s->count, shape);
    memcpy(a, s->a, sizeof a);
    memcpy(b, s->b, sizeof b);
    world_map_series(v, a, b, s->count);
    return dem2d_shape_create_fourier(NULL, a, b, s->count, shape);
}

/* The places 0 to count - 1 in the order of the run. */
static int world_place(const world_run *run, int i, int count) {
    return run->view.reordered ? count - 1 - i : i;
}

static void world_add_materials(world_run *run) {
    const world_script *s = run->script;
    const world_view *v = &run->view;
    for (int i = 0; i < s->material_count; i++) {
        const int k = world_place(run, i, s->material_count);
        dem2d_material_desc m = s->materials[k];
        m.density *= world_power(v->mass - 2 * v->length);
        m.normal_stiffness *= world_stiffness(v);
        m.tangential_stiffness *= world_stiffness(v);
        world_must(run, dem2d_world_add_material(run->world, &m, &run->materials[k]), "material");
    }
}

static void world_add_shapes(world_run *run) {
    const world_script *s = run->script;
    for (int i = 0; i < s->shape_count; i++) {
        const int k = world_place(run, i, s->shape_count);
        dem2d_shape *shape = NULL;
        world_must(run, world_create_shape(run, &s->shapes[k], &shape), "shape");
        if (run->fault[0] != 0) return;
        world_must(run, dem2d_world_add_shape(run->world, shape, &run->shapes[k]), "add_shape");
        dem2d_shape_destroy(shape);
    }
}

/* A number pushed, as a run does it. */
static double world_push(world_run *run, double value) {
    return value + run->view.push * random_between(&run->random, -1, 1);
}

/* Velocities too: where nothing turns but by rounding, local damping goes by the sign of that. */
static void world_push_grain(world_run *run, dem2d_particle_desc *g) {
    g->position.x = world_push(run, g->position.x);
    g->position.y = world_push(run, g->position.y);
    g->angle = world_push(run, g->angle);
    if (g->motion == DEM2D_FIXED) return;
    g->velocity.x = world_push(run, g->velocity.x);
    g->velocity.y = world_push(run, g->velocity.y);
    g->angular_velocity = world_push(run, g->angular_velocity);
}

static void world_add_grain(world_run *run, int which) {
    const world_view *v = &run->view;
    dem2d_particle_desc g = run->script->grains[which];
    if (run->grains[which].generation != 0) return;
    if (v->push != 0) world_push_grain(run, &g);
    g.shape = run->shapes[g.shape.index];
    g.material = run->materials[g.material.index];
    g.position = world_map(v, g.position, world_length(v));
    g.velocity = world_map(v, g.velocity, world_speed(v));
    g.angle *= world_sense(v);
    g.angular_velocity *= world_sense(v) / world_power(v->time);
    world_must(run, dem2d_world_add_particle(run->world, &g, &run->grains[which]), "add_particle");
}

/* The wall of a description, in the run's terms; false when a wall that it spans to is gone. */
static bool world_wall(world_run *run, const dem2d_wall_desc *desc, const dem2d_vec *turns,
                       dem2d_wall_desc *w) {
    const world_view *v = &run->view;
    *w = *desc;
    for (int i = 0; i < w->count; i++) { /* left of a mirrored chain stays left, too */
        const int back = w->closed ? (w->count - i) % w->count : w->count - 1 - i;
        run->turns[i] = world_map(v, turns[v->mirrored ? back : i], world_length(v));
    }
    if (w->count > 0) w->points = run->turns;
    w->pivot = world_map(v, w->pivot, world_length(v));
    w->angular_velocity *= world_sense(v) / world_power(v->time);
    w->surface_speed *= world_sense(v) * world_speed(v);
    w->material = run->materials[w->material.index];
    w->point = world_map(v, w->point, world_length(v));
    w->end = world_map(v, w->end, world_length(v));
    w->normal = world_map(v, w->normal, 1);
    if (v->mirrored) { /* left of a segment stays left */
        const dem2d_vec start = w->point;
        w->point = w->segment ? w->end : start;
        w->end = start;
    }
    w->velocity = world_map(v, w->velocity, world_speed(v));
    w->length *= world_length(v);
    w->stress *= world_stiffness(v);
    w->max_speed *= world_speed(v);
    for (int i = 0; i < 2; i++) {
        if (w->spans[i].generation == 0) continue;
        w->spans[i] = run->walls[w->spans[i].index];
        if (w->spans[i].generation == 0) return false;
    }
    return true;
}

static void world_add_wall(world_run *run, int which, const dem2d_wall_desc *desc,
                           const dem2d_vec *turns) {
    dem2d_wall_desc w;
    if (run->walls[which].generation != 0 || !world_wall(run, desc, turns, &w)) return;
    world_must(run, dem2d_world_add_wall(run->world, &w, &run->walls[which]), "add_wall");
}

/* Segments as they are, as the order of two says which counts where both end; then half-planes,
   those that span to others at the end. */
static void world_add_walls(world_run *run) {
    const world_script *s = run->script;
    for (int pass = 0; pass < 3; pass++)
        for (int i = 0; i < s->walls_at_first; i++) {
            const int k = pass > 0 ? world_place(run, i, s->walls_at_first) : i;
            const dem2d_wall_desc *w = &s->walls[k];
            if (pass == (w->segment || w->count > 0 ? 0 : w->spans[0].generation == 0 ? 1 : 2))
                world_add_wall(run, k, w, s->turns[k]);
        }
}

static dem2d_env world_env(world_run *run) {
    dem2d_env env = {run, world_allocate, world_release, NULL};
    return env;
}

static void world_begin(world_run *run) {
    const world_script *s = run->script;
    const world_view *v = &run->view;
    const dem2d_env env = world_env(run);
    dem2d_world_desc desc = s->desc;
    desc.time_step *= world_power(v->time);
    desc.gravity = world_map(v, desc.gravity, world_power(v->length - 2 * v->time));
    desc.global_damping /= world_power(v->time);
    desc.cell = world_cell(v, &desc.cell, world_length(v));
    desc.env = &env;
    if (s->law) desc.law = world_law;
    if (s->drag > 0) desc.loads = world_drag;
    desc.loads_user = run;
    if (v->shared) desc.parallel_for = world_parallel;
    desc.parallel_user = run;
    run->time_step = s->desc.time_step;
    run->gravity = s->desc.gravity;
    run->local_damping = s->desc.local_damping;
    run->global_damping = s->desc.global_damping;
    world_must(run, dem2d_world_create(&desc, &run->world), "create");
    if (run->fault[0] != 0) return;
    world_add_materials(run);
    world_add_shapes(run);
    world_add_walls(run);
    for (int i = 0; i < s->grains_at_first && run->fault[0] == 0; i++)
        world_add_grain(run, world_place(run, i, s->grains_at_first));
}

static void world_end(world_run *run) {
    dem2d_world_destroy(run->world);
    run->world = NULL;
    if (run->blocks != 0) world_fault(run, "%d blocks of memory are left", run->blocks);
}

/* --- events ------------------------------------------------------------------------------------
 */

static void world_wall_event(world_run *run, const world_event *e) {
    dem2d_wall_id *id = &run->walls[e->which];
    dem2d_wall_desc w;
    if (e->kind == EVENT_ADD_WALL) {
        if (id->generation == 0) world_met(run, WITH_WALLS);
        world_add_wall(run, e->which, &e->wall, e->turns);
    } else if (id->generation == 0) {
        return;
    } else if (e->kind == EVENT_SET_WALL) {
        if (!world_wall(run, &e->wall, e->turns, &w)) return;
        world_must(run, dem2d_world_set_wall(run->world, *id, &w), "set_wall");
        world_met(run, WITH_TURNED);
    } else {
        const dem2d_result result = dem2d_world_remove_wall(run->world, *id);
        if (result == DEM2D_IN_USE) return; /* by a wall that spans to it */
        world_must(run, result, "remove_wall");
        id->generation = 0;
        world_met(run, WITH_WALLS);
    }
}

/* A step that is too long by far is refused; the law may have changed before. All is as it was. */
static void world_refuse(world_run *run, const dem2d_pair_desc *pair, int a, int b) {
    dem2d_world *w = run->world;
    const double unit = world_power(run->view.time);
    double safe, limit;
    if (run->script->desc.skip_time_step_check || run->deformed) return;
    if (pair != NULL) {
        const dem2d_pair_desc law = world_pair(&run->view, pair);
        world_must(run, dem2d_world_set_pair(w, run->materials[a], run->materials[b], &law),
                   "set_pair");
    }
    world_must(run, dem2d_world_time_step_bounds(w, &safe, &limit, NULL), "bounds");
    if (!(limit < 1e3 * run->time_step * unit)) return;
    world_must(run, dem2d_world_set_time_step(w, 1e5 * run->time_step * unit), "set_time_step");
    const uint64_t before = dem2d_world_hash(w);
    int done;
    const dem2d_result result = dem2d_world_step(w, 1, &done);
    if (result != DEM2D_OK && dem2d_world_hash(w) != before && run->script->drag == 0)
        world_fault(run, "a refused step changes the hash"); /* a callback's loads may stay */
    if (done != (result == DEM2D_OK))
        world_fault(run, "%d steps done: %s", done, dem2d_result_text(result));
    world_must(run, dem2d_world_set_time_step(w, run->time_step * unit), "set_time_step");
    if (result == DEM2D_OK)
        run->spoiled = true;
    else
        world_met(run, WITH_REFUSED);
}

static void world_law_event(world_run *run, const world_event *e) {
    const world_view *v = &run->view;
    const double over_time = 1 / world_power(v->time);
    dem2d_pair_desc law = world_pair(v, &e->pair);
    if (e->kind == EVENT_PAIR) {
        world_must(run,
                   dem2d_world_set_pair(run->world, run->materials[e->which],
                                        run->materials[e->other], &law),
                   "set_pair");
        world_met(run, WITH_PAIR);
    } else if (e->kind == EVENT_GRAVITY) {
        const dem2d_vec g = world_map(v, e->at, world_power(v->length - 2 * v->time));
        run->gravity = e->at;
        world_must(run, dem2d_world_set_gravity(run->world, g), "set_gravity");
        world_met(run, WITH_GRAVITY);
    } else if (e->kind == EVENT_DAMPING) {
        run->local_damping = e->number, run->global_damping = e->more;
        world_must(run, dem2d_world_set_damping(run->world, e->number, e->more * over_time),
                   "set_damping");
        world_met(run, WITH_DAMPING);
    } else if (e->kind == EVENT_TIME_STEP) {
        run->time_step = e->number;
        world_must(run, dem2d_world_set_time_step(run->world, e->number / over_time),
                   "set_time_step");
        world_met(run, WITH_TIME_STEP);
    } else if (e->kind == EVENT_REFUSED) {
        world_refuse(run, e->motion == DEM2D_FREE ? &e->pair : NULL, e->which, e->other);
    }
}

/* Velocities and loads of all that are free, as arrays of a struct. */
static void world_write_rows(world_run *run, const world_event *e) {
    const world_view *v = &run->view;
    struct {
        dem2d_particle_id id;
        dem2d_vec velocity, load;
        double spin, torque;
    } rows[MOST_GRAINS];
    int count = 0;
    for (int i = 0; i < run->script->grain_count; i++) {
        dem2d_particle_info p;
        if (run->grains[i].generation == 0) continue;
        if (dem2d_world_get_particle(run->world, run->grains[i], &p) != DEM2D_OK) continue;
        if (p.motion != DEM2D_FREE) continue;
        const double part = 1 + 0.125 * i, spin = e->angle * part * world_sense(v);
        rows[count].id = run->grains[i];
        rows[count].velocity = world_map(v, vec(e->at.x * part, e->at.y), world_speed(v));
        rows[count].load = world_map(v, vec(e->at.y, e->at.x * part), world_force(v));
        rows[count].spin = spin / world_power(v->time);
        rows[count++].torque = spin * world_force(v) * world_length(v);
    }
    dem2d_particle_arrays a;
    memset(&a, 0, sizeof a);
    a.stride = sizeof rows[0];
    a.ids = &rows[0].id, a.velocities = &rows[0].velocity, a.loads = &rows[0].load;
    a.angular_velocities = &rows[0].spin, a.load_torques = &rows[0].torque;
    world_must(run, dem2d_world_write_particles(run->world, &a, count), "write_particles");
    world_met(run, WITH_ROWS);
}

static void world_relax_event(world_run *run, const world_event *e) {
    dem2d_relaxation done;
    world_must(run, dem2d_world_relax(run->world, e->more, 5, &done), "relax");
    if (done.moved > 0) world_met(run, WITH_RELAX);
}

static void world_deform_event(world_run *run, const world_event *e) {
    const world_view *v = &run->view;
    dem2d_deformation_desc flow = e->flow;
    const double rate = 1 / world_power(v->time);
    flow.xx *= rate, flow.xy *= rate * world_sense(v), flow.yy *= rate;
    flow.stress_xx *= world_stiffness(v), flow.stress_yy *= world_stiffness(v);
    flow.stress_yx *= world_stiffness(v) * world_sense(v);
    world_must(run, dem2d_world_deform(run->world, &flow), "deform");
    run->deformed = true;
    world_met(run, flow.hold_xx || flow.hold_yx || flow.hold_yy ? WITH_HELD : WITH_FLOW);
}

/* Edits of what a grain is, and of a wall's motion. */
static void world_more_event(world_run *run, const world_event *e) {
    const world_view *v = &run->view;
    const dem2d_particle_id id = run->grains[e->kind == EVENT_DRIVE_WALL ? 0 : e->which];
    dem2d_particle_info p;
    if (e->kind == EVENT_ROWS) world_write_rows(run, e);
    if (e->kind == EVENT_RELAX) world_relax_event(run, e);
    if (e->kind == EVENT_DEFORM) world_deform_event(run, e);
    if (e->kind == EVENT_DRIVE_WALL && run->walls[e->which].generation != 0 &&
        run->script->walls[e->which].mode == DEM2D_WALL_MOVING) {
        const double spin = run->script->walls[e->which].count > 0 ? e->angle : 0;
        const dem2d_result result = dem2d_world_drive_wall(
            run->world, run->walls[e->which], world_map(v, e->at, world_speed(v)),
            spin * world_sense(v) / world_power(v->time));
        if (result != DEM2D_OUT_OF_RANGE) world_must(run, result, "drive_wall");
    }
    if (e->kind >= EVENT_ROWS || id.generation == 0) return;
    world_must(run, dem2d_world_get_particle(run->world, id, &p), "get_particle");
    if (e->kind == EVENT_GROUPS) {
        world_must(run, dem2d_world_set_groups(run->world, id, e->groups), "set_groups");
        world_must(run, dem2d_world_set_user_data(run->world, id, p.user_data + 1), "user_data");
        world_met(run, e->groups.sensor ? WITH_SENSOR : WITH_GROUPS);
    } else if (e->kind == EVENT_MATERIAL) {
        world_must(run, dem2d_world_set_material(run->world, id, run->materials[e->other]),
                   "set_material");
        world_met(run, WITH_MATERIAL);
    } else {
        const bool other = e->kind == EVENT_SHAPE;
        const double scale = other ? 1 : p.pose.scale * e->number;
        world_must(
            run,
            dem2d_world_set_shape(run->world, id, other ? run->shapes[e->other] : p.shape, scale),
            "set_shape");
        world_met(run, other ? WITH_SHAPE : WITH_SCALE);
    }
}

static void world_event_apply(world_run *run, const world_event *e) {
    const world_view *v = &run->view;
    dem2d_particle_id *id = &run->grains[e->which];
    const bool there = e->kind <= EVENT_DRIVE && id->generation != 0;
    if (e->kind >= EVENT_MORE) {
        world_more_event(run, e);
    } else if (e->kind > EVENT_DRIVE) {
        if (e->kind <= EVENT_REMOVE_WALL)
            world_wall_event(run, e);
        else
            world_law_event(run, e);
    } else if (e->kind == EVENT_ADD) {
        if (!there) world_met(run, WITH_ADDED);
        world_add_grain(run, e->which);
    } else if (!there) {
        return;
    } else if (e->kind == EVENT_REMOVE) {
        world_must(run, dem2d_world_remove_particle(run->world, *id), "remove_particle");
        id->generation = 0;
        world_met(run, WITH_REMOVED);
    } else if (e->kind == EVENT_MOVE) {
        const dem2d_vec to = world_map(v, e->at, world_length(v));
        world_must(run, dem2d_world_move_particle(run->world, *id, to, e->angle * world_sense(v)),
                   "move_particle");
        world_met(run, WITH_MOVED);
    } else if (e->kind == EVENT_LOAD) {
        const double torque = e->angle * world_sense(v) * world_force(v) * world_length(v);
        const dem2d_vec force = world_map(v, vec(9 * e->at.x, 9 * e->at.y), world_force(v));
        world_must(run, dem2d_world_set_load(run->world, *id, force, torque), "set_load");
        world_met(run, WITH_LOADS);
    } else {
        const double go = e->motion == DEM2D_FIXED ? 0 : 1;
        const dem2d_vec to = world_map(v, vec(go * e->at.x, go * e->at.y), world_speed(v));
        world_must(
            run,
            dem2d_world_drive_particle(run->world, *id, e->motion, to,
                                       go * e->angle * world_sense(v) / world_power(v->time)),
            "drive_particle");
    }
}

/* --- sights ------------------------------------------------------------------------------------
 */

/* Sizes of the script: a radius of 1 m, a stiffness of 1e4 N/m, a time of 0.01 s. */
static const double world_stiff = 1e4, world_moment = 0.01;

/* A place up to cell vectors: by functions that have them for periods, of which the last bits go:
   without memory, a particle comes back into the cell a step later. */
static void world_see_in_cell(const world_run *run, dem2d_vec x, double to[2]) {
    dem2d_cell_info now;
    if (dem2d_world_get_cell(run->world, &now) != DEM2D_OK) return;
    const dem2d_cell cell = world_cell(&run->view, &now.cell, 1 / world_length(&run->view));
    const double turn = 6.283185307179586, up = x.y - cell.origin.y;
    const double t = cell.b.y > 0 ? up / cell.b.y : 0;
    const double s = (x.x - cell.origin.x - t * cell.b.x) / cell.a.x;
    to[0] = floor(ldexp(sin(turn * s + 0.3), 40) + 0.5) / ldexp(1, 40);
    to[1] = x.y;
    if (cell.b.y > 0) to[1] = floor(ldexp(sin(turn * t + 0.3), 40) + 0.5) / ldexp(1, 40);
}

static void world_see_grain(const world_run *run, int i, double to[GRAIN_NUMBERS]) {
    const world_view *v = &run->view;
    const double force = world_force(v) * world_stiff, sense = world_sense(v);
    dem2d_particle_info p;
    if (run->grains[i].generation == 0) return;
    if (dem2d_world_get_particle(run->world, run->grains[i], &p) != DEM2D_OK) return;
    const dem2d_vec x = world_unmap(v, p.pose.position, world_length(v));
    const dem2d_vec u = world_unmap(v, p.velocity, world_speed(v));
    const dem2d_vec f = world_unmap(v, p.force, force);
    to[0] = x.x, to[1] = x.y;
    if (world_in_cell(run->script)) world_see_in_cell(run, x, to);
    to[2] = p.pose.rotation.c, to[3] = sense * p.pose.rotation.s;
    to[4] = u.x * world_moment, to[5] = u.y * world_moment;
    to[6] = sense * p.angular_velocity * world_power(v->time) * world_moment;
    to[7] = f.x, to[8] = f.y;
    to[9] = sense * p.torque / world_length(v) / force;
}

static void world_see_wall(const world_run *run, int j, double to[WALL_NUMBERS]) {
    const world_view *v = &run->view;
    dem2d_wall_info w;
    if (run->walls[j].generation == 0) return;
    if (dem2d_world_get_wall(run->world, run->walls[j], &w) != DEM2D_OK) return;
    const dem2d_wall_desc *desc = &run->script->walls[j];
    const bool turned = (w.segment || desc->count > 0) && !desc->closed;
    const dem2d_vec start = v->mirrored && turned ? w.end : w.point;
    const dem2d_vec x = world_unmap(v, start, world_length(v));
    const dem2d_vec u = world_unmap(v, w.velocity, world_speed(v));
    const dem2d_vec f = world_unmap(v, w.force, world_force(v) * world_stiff);
    to[0] = x.x, to[1] = x.y;
    to[2] = u.x * world_moment, to[3] = u.y * world_moment;
    to[4] = f.x, to[5] = f.y;
}

/* Contact events since the last step go into the hash: their order, their bits, how many were
   lost. */
static void world_see_events(world_run *run, world_sight *sight) {
    dem2d_contact_event events[MOST_TOLD];
    const unsigned char *bytes = (const unsigned char *)events;
    int64_t lost;
    int count;
    world_must(run, dem2d_world_events(run->world, events, MOST_TOLD, &count, &lost), "events");
    if (count > 0) world_met(run, WITH_EVENTS);
    for (size_t k = 0; k < (size_t)count * sizeof *events; k++)
        sight->hash = (sight->hash ^ bytes[k]) * 0x100000001b3u;
    sight->hash = (sight->hash ^ (uint64_t)lost) * 0x100000001b3u;
}

static void world_see(world_run *run, world_sight *sight) {
    const world_view *v = &run->view;
    const double unit = world_force(v) * world_length(v) * world_stiff;
    dem2d_energy e;
    memset(sight->grain, 0, sizeof sight->grain);
    memset(sight->wall, 0, sizeof sight->wall);
    for (int i = 0; i < run->script->grain_count; i++) world_see_grain(run, i, sight->grain[i]);
    for (int j = 0; j < run->script->wall_count; j++) world_see_wall(run, j, sight->wall[j]);
    world_must(run, dem2d_world_energy(run->world, &e), "energy");
    const double energy[ENERGY_NUMBERS] = {e.translational, e.rotational, e.normal,
                                           e.tangential,    e.rolling,    e.potential};
    for (int k = 0; k < ENERGY_NUMBERS; k++) sight->energy[k] = energy[k] / unit;
    if (world_in_cell(run->script)) sight->energy[5] = 0; /* that of wrapped grains jumps */
    sight->hash = dem2d_world_hash(run->world);
    if (run->script->desc.event_capacity > 0) world_see_events(run, sight);
}

enum { SIGHT_NUMBERS = MOST_GRAINS * GRAIN_NUMBERS + MOST_WALLS * WALL_NUMBERS + ENERGY_NUMBERS };

/* One number of a sight, and its name. */
static double world_number(const world_sight *s, int k, char name[32]) {
    static const char *const of_grain[GRAIN_NUMBERS] = {
        "x", "y", "cos", "sin", "vx", "vy", "spin", "force x", "force y", "torque"};
    static const char *const of_wall[WALL_NUMBERS] = {"x", "y", "vx", "vy", "force x", "force y"};
    static const char *const of_energy[ENERGY_NUMBERS] = {
        "translational", "rotational", "normal", "tangential", "rolling", "potential"};
    if (k < MOST_GRAINS * GRAIN_NUMBERS) {
        const int i = k / GRAIN_NUMBERS, n = k % GRAIN_NUMBERS;
        if (name != NULL) snprintf(name, 32, "grain %d %s", i, of_grain[n]);
        return s->grain[i][n];
    }
    k -= MOST_GRAINS * GRAIN_NUMBERS;
    if (k < MOST_WALLS * WALL_NUMBERS) {
        const int i = k / WALL_NUMBERS, n = k % WALL_NUMBERS;
        if (name != NULL) snprintf(name, 32, "wall %d %s", i, of_wall[n]);
        return s->wall[i][n];
    }
    k -= MOST_WALLS * WALL_NUMBERS;
    if (name != NULL) snprintf(name, 32, "%s energy", of_energy[k]);
    return s->energy[k];
}

/* The greatest difference of two sights, and where. */
static double world_difference(const world_sight *a, const world_sight *b, int *where) {
    double most = 0;
    *where = 0;
    for (int k = 0; k < SIGHT_NUMBERS; k++) {
        const double off = fabs(world_number(a, k, NULL) - world_number(b, k, NULL));
        if (off <= most) continue; /* not so for a NaN */
        most = off;
        *where = k;
    }
    return most;
}

/* --- what must hold in a run -------------------------------------------------------------------
 */

/* |value| is rounding of numbers of a size. */
static bool world_is_rounding(double value, double size) {
    return fabs(value) <= 1e-11 * size;
}

/* Forces on the particles and walls of a script, and their sizes: of one step. */
typedef struct world_sums {
    dem2d_vec grain[MOST_GRAINS], wall[MOST_WALLS];
    double torque[MOST_GRAINS], size[MOST_GRAINS + MOST_WALLS];
} world_sums;

static int world_grain_of(const world_run *run, dem2d_particle_id id) {
    for (int i = 0; i < run->script->grain_count; i++)
        if (id.generation != 0 && run->grains[i].generation == id.generation &&
            run->grains[i].index == id.index)
            return i;
    return -1;
}

static int world_wall_of(const world_run *run, dem2d_wall_id id) {
    for (int j = 0; j < run->script->wall_count; j++)
        if (run->walls[j].generation == id.generation && run->walls[j].index == id.index) return j;
    return -1;
}

static void world_add_force(world_sums *sums, int i, dem2d_vec arm, dem2d_vec force,
                            double moment) {
    sums->grain[i].x += force.x, sums->grain[i].y += force.y;
    sums->torque[i] += arm.x * force.y - arm.y * force.x + moment;
    sums->size[i] += fabs(force.x) + fabs(force.y) + fabs(moment);
}

/* What was known of the particles and the cell before a step. */
typedef struct world_before {
    dem2d_particle_info grain[MOST_GRAINS];
    dem2d_vec at[MOST_GRAINS];
    dem2d_cell cell;
} world_before;

/* What one contact does to its two; places are those of the last force pass. */
static void world_sum_contact(world_run *run, const dem2d_contact_info *c,
                              const world_before *before, world_sums *sums) {
    const dem2d_vec *at = before->at, n = c->normal, p = c->point;
    const double fn = c->sign * c->normal_force, ft = c->sign * c->tangential_force;
    const dem2d_vec on_b = vec(fn * n.x - ft * n.y, fn * n.y + ft * n.x);
    const dem2d_vec on_a = vec(-on_b.x, -on_b.y);
    const int a = world_grain_of(run, c->a), b = world_grain_of(run, c->b);
    const int wall = b < 0 ? world_wall_of(run, c->wall) : -1;
    if (a < 0 || (b < 0 && wall < 0)) {
        world_fault(run, "a contact of nobody");
        return;
    }
    if (c->points == 2) world_met(run, WITH_TWO_POINTS);
    world_add_force(sums, a, vec(p.x - at[a].x, p.y - at[a].y), on_a, -c->moment);
    if (b >= 0) {
        const dem2d_cell *cell = &before->cell; /* B may be an image */
        const double x = at[b].x + c->shift[0] * cell->a.x + c->shift[1] * cell->b.x;
        const double y = at[b].y + c->shift[1] * cell->b.y;
        world_add_force(sums, b, vec(p.x - x, p.y - y), on_b, c->moment);
        return;
    }
    sums->wall[wall].x += on_b.x, sums->wall[wall].y += on_b.y;
    sums->size[MOST_GRAINS + wall] += fabs(on_b.x) + fabs(on_b.y);
    const dem2d_wall_desc *desc = &run->script->walls[wall];
    if (desc->mode == DEM2D_WALL_SERVO) world_met(run, WITH_SERVO);
    if (desc->mode == DEM2D_WALL_MOVING) world_met(run, WITH_MOVING);
    if (desc->segment) world_met(run, WITH_SEGMENT);
    if (desc->count > 0) world_met(run, WITH_POINTS);
    if (desc->one_sided) world_met(run, WITH_ONE_SIDED);
    if (desc->angular_velocity != 0) world_met(run, WITH_TURNING);
    if (desc->surface_speed != 0) world_met(run, WITH_BELT);
    if (desc->segment && run->script->walls[1].segment) world_met(run, WITH_CHAIN);
}

static void world_look_before(const world_run *run, world_before *before) {
    dem2d_cell_info now;
    memset(&now, 0, sizeof now);
    (void)dem2d_world_get_cell(run->world, &now);
    before->cell = now.cell;
    for (int i = 0; i < run->script->grain_count; i++) {
        if (run->grains[i].generation == 0) continue;
        (void)dem2d_world_get_particle(run->world, run->grains[i], &before->grain[i]);
        before->at[i] = before->grain[i].pose.position;
    }
}

/* One component of a free particle's motion: dv = dt a less the dampings; size is that of the parts
   of a. */
static bool world_moves(const world_run *run, double before, double after, double acceleration,
                        double size) {
    const double dt = run->time_step;
    const double drag = before != 0 ? run->local_damping * fabs(acceleration) : 0;
    const double pushed = acceleration - (before < 0 ? -drag : drag);
    const double rate = pushed - run->global_damping * (before + after) / 2;
    return world_is_rounding(after - before - dt * rate, fabs(before) + dt * size);
}

static void world_check_grain(world_run *run, int i, const world_before *before,
                              const world_sums *sums) {
    const dem2d_particle_info *was = &before->grain[i];
    dem2d_particle_info is;
    world_must(run, dem2d_world_get_particle(run->world, run->grains[i], &is), "get_particle");
    const double size = sums->size[i], far = 4 + fabs(before->at[i].x) + fabs(before->at[i].y);
    if (!world_is_rounding(is.force.x - sums->grain[i].x, size) ||
        !world_is_rounding(is.force.y - sums->grain[i].y, size) ||
        !world_is_rounding(is.torque - sums->torque[i], far * size))
        world_fault(run, "forces of the contacts are not the force on grain %d", i);
    if (is.motion == DEM2D_FIXED) world_met(run, WITH_FIXED);
    if (is.motion == DEM2D_DRIVEN) world_met(run, WITH_DRIVEN);
    /* without contacts: gravity and loads */
    const dem2d_vec g =
        vec(run->gravity.x + is.load.x / is.mass, run->gravity.y + is.load.y / is.mass);
    const double turn = is.load_torque / is.inertia;
    if (is.motion != DEM2D_FREE) {
        if (was->velocity.x != is.velocity.x || was->velocity.y != is.velocity.y ||
            was->angular_velocity != is.angular_velocity)
            world_fault(run, "grain %d is not free, but its velocity changes", i);
    } else if (run->deformed) {
        return; /* the flow acts on velocities */
    } else if (!world_moves(run, was->velocity.x, is.velocity.x, is.force.x / is.mass + g.x,
                            size / is.mass + fabs(run->gravity.x) + fabs(is.load.x) / is.mass) ||
               !world_moves(run, was->velocity.y, is.velocity.y, is.force.y / is.mass + g.y,
                            size / is.mass + fabs(run->gravity.y) + fabs(is.load.y) / is.mass) ||
               !world_moves(run, was->angular_velocity, is.angular_velocity,
                            is.torque / is.inertia + turn, 4 * size / is.inertia + fabs(turn))) {
        world_fault(run, "grain %d does not move as the forces on it say", i);
    }
}

/* Sums after a step that was taken; the run is told in the units of the script. */
static void world_check_sums(world_run *run, const world_before *before) {
    enum { ROOM = 2 * MOST_GRAINS * (MOST_GRAINS + MOST_WALLS) };
    dem2d_contact_info contacts[ROOM];
    world_sums sums;
    int count;
    double x = 0, y = 0, all = 0;
    memset(&sums, 0, sizeof sums);
    world_must(run, dem2d_world_contacts(run->world, contacts, ROOM, &count), "contacts");
    for (int k = 0; k < count && k < ROOM; k++) world_sum_contact(run, &contacts[k], before, &sums);
    for (int i = 0; i < run->script->grain_count; i++) {
        if (run->grains[i].generation == 0) continue;
        world_check_grain(run, i, before, &sums);
        x += sums.grain[i].x, y += sums.grain[i].y, all += sums.size[i];
    }
    for (int j = 0; j < run->script->wall_count; j++) {
        dem2d_wall_info w;
        if (run->walls[j].generation == 0) continue;
        world_must(run, dem2d_world_get_wall(run->world, run->walls[j], &w), "get_wall");
        const double size = sums.size[MOST_GRAINS + j];
        if (!world_is_rounding(w.force.x - sums.wall[j].x, size) ||
            !world_is_rounding(w.force.y - sums.wall[j].y, size))
            world_fault(run, "forces of the contacts are not the force on wall %d", j);
        x += sums.wall[j].x, y += sums.wall[j].y;
    }
    if (!world_is_rounding(x, all) || !world_is_rounding(y, all))
        world_fault(run, "momentum is not conserved");
}

/* Circles and half-planes alone, where normals do not jump; the mass of the lightest. */
static bool world_is_smooth(const world_script *s, double *lightest) {
    *lightest = HUGE_VAL;
    for (int i = 0; i < s->grain_count; i++) {
        const world_shape *shape = &s->shapes[s->grains[i].shape.index];
        const double radius = shape->size[0] * s->grains[i].scale;
        const double density = s->materials[s->grains[i].material.index].density;
        if (shape->type != DEM2D_CIRCLE) return false;
        *lightest = fmin(*lightest, density * 3.141592653589793 * radius * radius);
    }
    for (int j = 0; j < s->wall_count; j++)
        if ((s->walls[j].segment || s->walls[j].count > 0) && j < s->walls_at_first) return false;
    for (int k = 0; k < s->event_count; k++) {
        const world_event *e = &s->events[k];
        if (e->kind == EVENT_ADD_WALL && (e->wall.segment || e->wall.count > 0)) return false;
        if (e->kind == EVENT_SHAPE || e->kind == EVENT_MATERIAL) return false; /* other masses */
        if (e->kind == EVENT_SCALE) *lightest *= 0.96;                         /* (0.98)^2 */
    }
    return true;
}

/* A contact that opens or closes within a step is booked as if at its end: at most k (v dt)^2/2 is
   missing, (w dt)^2 of the energy m v^2/2, with w^2 = k/m; a grain has at most about four contacts
   at a time. The ledger closes to that part of what has been turned over and still moves. */
static void world_check_ledger(world_run *run) {
    const double dt = run->longest_step, stiffest = 4e4; /* of world_make_pair */
    double lightest;
    dem2d_ledger l;
    if (!run->script->desc.ledger || !world_is_smooth(run->script, &lightest)) return;
    world_must(run, dem2d_world_ledger(run->world, &l), "ledger");
    const double part = 4 * (stiffest / lightest) * (dt * dt);
    const double rounding = 1e-12 * world_stiff;
    if (!(fabs(l.closure) <= part * (l.turnover + fabs(l.kinetic)) + rounding))
        world_fault(run, "the ledger does not close: %.3g of %.3g turned over", l.closure,
                    l.turnover);
}

/* --- what a run does between its steps ---------------------------------------------------------
 */

static bool world_same_bytes(const scene_bytes *a, const scene_bytes *b) {
    return a->size == b->size && memcmp(a->bytes, b->bytes, a->size) == 0;
}

/* The world is saved, and what is loaded takes its place. */
static void world_interrupt(world_run *run) {
    scene_bytes saved = scene_save(run->world), again = {NULL, 0, 0, 0, 0};
    const dem2d_env env = world_env(run);
    dem2d_world *loaded = NULL;
    dem2d_load_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.read = scene_read;
    desc.user = &saved;
    desc.custom = world_custom;
    desc.custom_user = run;
    if (run->script->law) desc.law = world_law;
    if (run->script->drag > 0) desc.loads = world_drag;
    desc.loads_user = run;
    if (run->view.shared) desc.parallel_for = world_parallel;
    desc.parallel_user = run;
    desc.env = &env;
    const dem2d_result result = dem2d_world_load(&desc, NULL, &loaded);
    if (result == DEM2D_OK) {
        dem2d_world_destroy(run->world);
        run->world = loaded;
        again = scene_save(run->world);
        if (!world_same_bytes(&saved, &again)) world_fault(run, "saved again, other bytes");
        world_met(run, WITH_SNAPSHOT);
    } else {
        world_fault(run, "a snapshot is not read: %s", dem2d_result_text(result));
    }
    free(saved.bytes);
    free(again.bytes);
}

/* --- questions of space ------------------------------------------------------------------------
 */

enum { MOST_FOUND = 512, MOST_SHIFT = 6 };

/* How often a grain is found: once, or in a cell some of its images. */
static int world_has(const dem2d_found *found, int count, dem2d_particle_id id) {
    int has = 0;
    for (int k = 0; k < count; k++)
        has += found[k].particle.index == id.index && found[k].particle.generation == id.generation;
    return has;
}

/* May the groups of two meet, sensors or not? */
static bool world_groups_meet(dem2d_groups a, dem2d_groups b) {
    return (a.category == 0 || b.mask == 0 || (a.category & b.mask) != 0) &&
           (b.category == 0 || a.mask == 0 || (b.category & a.mask) != 0);
}

/* What a point is in, and what overlaps a grain, against each of the grains alone. */
static void world_ask_grains(world_run *run, dem2d_vec point, int self) {
    dem2d_found at[MOST_FOUND], over[MOST_FOUND];
    dem2d_particle_info own, other;
    dem2d_cell_info now;
    int found = 0, overlaps = 0;
    if (dem2d_world_get_particle(run->world, run->grains[self], &own) != DEM2D_OK) return;
    world_must(run, dem2d_world_get_cell(run->world, &now), "get_cell");
    const dem2d_shape *shape = dem2d_world_shape(run->world, own.shape);
    world_must(run, dem2d_world_query_point(run->world, point, NULL, at, MOST_FOUND, &found),
               "query_point");
    world_must(run,
               dem2d_world_particle_overlaps(run->world, run->grains[self], NULL, over, MOST_FOUND,
                                             &overlaps),
               "particle_overlaps");
    for (int i = 0; i < run->script->grain_count; i++) {
        int inside = 0, overlap = 0;
        if (run->grains[i].generation == 0) continue;
        world_must(run, dem2d_world_get_particle(run->world, run->grains[i], &other), "grain");
        const dem2d_shape *its = dem2d_world_shape(run->world, other.shape);
        const dem2d_pose pose = other.pose;
        const int most_s = now.cell.a.x > 0 ? MOST_SHIFT : 0;
        const int most_t = now.cell.b.y > 0 ? MOST_SHIFT : 0;
        for (int m = -most_s; m <= most_s; m++)
            for (int n = -most_t; n <= most_t; n++) {
                dem2d_contact contact;
                bool in = false;
                other.pose.position.x = pose.position.x + m * now.cell.a.x + n * now.cell.b.x;
                other.pose.position.y = pose.position.y + n * now.cell.b.y;
                world_must(run, dem2d_shape_contains(its, other.pose, point, &in), "contains");
                world_must(run,
                           dem2d_pair_overlap(shape, own.pose, its, other.pose, NULL, &contact),
                           "overlap");
                inside += in;
                overlap += contact.state != DEM2D_SEPARATED && (i != self || m != 0 || n != 0) &&
                           world_groups_meet(own.groups, other.groups);
            }
        if (inside != world_has(at, found, run->grains[i]))
            world_fault(run, "query_point: grain %d", i);
        if (overlap != world_has(over, overlaps, run->grains[i]))
            world_fault(run, "particle_overlaps: grain %d and %d", self, i);
    }
}

static bool world_same_found(const dem2d_found *a, const dem2d_found *b) {
    return memcmp(&a->particle, &b->particle, sizeof a->particle) == 0 &&
           memcmp(&a->wall, &b->wall, sizeof a->wall) == 0 && a->part == b->part &&
           memcmp(a->shift, b->shift, sizeof a->shift) == 0;
}

/* The first hit is the first of all, and hits are sorted. */
static void world_ask_ray(world_run *run, dem2d_vec from, dem2d_vec along) {
    dem2d_hit hit, all[MOST_FOUND];
    int count = 0;
    const double length = world_in_cell(run->script) ? 9 : 0;
    world_must(run, dem2d_world_cast_ray(run->world, from, along, length, NULL, &hit), "cast_ray");
    world_must(
        run,
        dem2d_world_cast_ray_all(run->world, from, along, length, NULL, all, MOST_FOUND, &count),
        "cast_ray_all");
    const bool none = hit.found.particle.generation + hit.found.wall.generation == 0;
    if (none != (count == 0)) world_fault(run, "a ray hits %d, and has no first", count);
    if (count > 0 && !(world_same_found(&hit.found, &all[0].found) &&
                       memcmp(&hit.normal, &all[0].normal, sizeof hit.normal) == 0 &&
                       hit.distance == all[0].distance))
        world_fault(run, "the first hit of a ray is not the first of all");
    for (int k = 1; k < count; k++)
        if (all[k].distance < all[k - 1].distance) world_fault(run, "hits are not sorted");
}

/* A disc a little smaller than the distance of the nearest overlaps nothing, a larger one does. */
static void world_ask_nearest(world_run *run, dem2d_vec point) {
    dem2d_hit hit;
    dem2d_shape *disc = NULL;
    int fewer = 0, more = 0;
    world_must(run, dem2d_world_nearest(run->world, point, 0, NULL, &hit), "nearest");
    world_must(run, dem2d_shape_create_circle(NULL, 1, &disc), "circle");
    if (hit.distance > 1e-3) {
        dem2d_pose pose = {point, {1, 0}, hit.distance * (1 - 1e-6)};
        world_must(run, dem2d_world_query_shape(run->world, disc, pose, NULL, NULL, 0, &fewer),
                   "query_shape");
        pose.scale = hit.distance * (1 + 1e-6);
        world_must(run, dem2d_world_query_shape(run->world, disc, pose, NULL, NULL, 0, &more),
                   "query_shape");
        if (fewer != 0 || more == 0)
            world_fault(run, "nearest: %d within the distance, %d beyond", fewer, more);
    }
    dem2d_shape_destroy(disc);
}

/* A wall overlaps a grain that it meets where the grain's shape overlaps the wall. */
static void world_ask_wall(world_run *run, int wall, int grain) {
    dem2d_found over[MOST_FOUND], at[MOST_FOUND];
    dem2d_particle_info own;
    dem2d_wall_info its;
    int overlaps = 0, found = 0;
    bool touches = false;
    if (run->walls[wall].generation == 0 || run->grains[grain].generation == 0) return;
    world_must(run, dem2d_world_get_particle(run->world, run->grains[grain], &own), "grain");
    world_must(run, dem2d_world_get_wall(run->world, run->walls[wall], &its), "wall");
    world_must(
        run,
        dem2d_world_wall_overlaps(run->world, run->walls[wall], NULL, over, MOST_FOUND, &overlaps),
        "wall_overlaps");
    world_must(run,
               dem2d_world_query_shape(run->world, dem2d_world_shape(run->world, own.shape),
                                       own.pose, NULL, at, MOST_FOUND, &found),
               "query_shape");
    for (int k = 0; k < found; k++)
        touches |= at[k].wall.generation != 0 && at[k].wall.index == run->walls[wall].index;
    touches = touches && world_groups_meet(own.groups, its.groups);
    const int images = world_has(over, overlaps, run->grains[grain]);
    if (touches != (images > 0) || (images > 1 && !world_in_cell(run->script)))
        world_fault(run, "wall_overlaps: wall %d, grain %d", wall, grain);
}

/* Everything is in a box around everything. */
static void world_ask_space(world_run *run) {
    const bool cell = world_in_cell(run->script);
    const double far = cell ? 9 : 1e3 * world_length(&run->view);
    const dem2d_box all = {{-far, -far}, {far, far}};
    uint64_t *r = &run->random;
    dem2d_found found[MOST_FOUND];
    int count = 0, particles, last = -1;
    for (int k = 0; k < 3; k++) {
        const dem2d_vec p = vec(random_between(r, -1, 4), random_between(r, 0, 4));
        const dem2d_vec along = vec(random_between(r, -1, 1), random_between(r, -1, 1));
        const int grain = random_below(r, run->script->grain_count);
        world_ask_grains(run, p, grain);
        world_ask_ray(run, p, along);
        world_ask_nearest(run, p);
        if (run->script->wall_count > 0)
            world_ask_wall(run, random_below(r, run->script->wall_count), grain);
    }
    world_must(run, dem2d_world_query_box(run->world, &all, NULL, found, MOST_FOUND, &count),
               "query_box");
    world_must(run, dem2d_world_particles(run->world, NULL, 0, &particles), "particles");
    for (int k = 0; k < particles && k < count; k++) {
        if (found[k].particle.generation == 0 || (int)found[k].particle.index < last + !cell)
            world_fault(run, "query_box: row %d", k);
        last = (int)found[k].particle.index;
    }
    if (count < particles) world_fault(run, "query_box: %d of %d particles", count, particles);
}

/* All else that can be asked; what the answers are does not matter. */
static void world_ask(world_run *run) {
    dem2d_world *w = run->world;
    dem2d_stats stats;
    dem2d_energy energy;
    dem2d_ledger ledger;
    dem2d_stress stress;
    dem2d_packing packing;
    dem2d_fabric fabric;
    dem2d_equilibrium rest;
    dem2d_particle_id id;
    dem2d_particle_info info;
    dem2d_contact_info contact;
    double values[4], safe, limit;
    int count;
    world_must(run, dem2d_world_stats(w, &stats), "stats");
    world_must(run, dem2d_world_energy(w, &energy), "energy");
    world_must(run, dem2d_world_stress(w, 1, &stress), "stress");
    world_must(run, dem2d_world_packing(w, &packing), "packing");
    world_must(run, dem2d_world_fabric(w, &fabric), "fabric");
    world_must(run, dem2d_world_equilibrium(w, &rest), "equilibrium");
    world_must(run, dem2d_world_histogram(w, DEM2D_HISTOGRAM_NORMAL_FORCE, 4, values), "histogram");
    world_must(run, dem2d_world_time_step_bounds(w, &safe, &limit, NULL), "bounds");
    world_must(run, dem2d_world_contacts(w, &contact, 1, &count), "contacts");
    world_must(run, dem2d_world_particles(w, &id, 1, &count), "particles");
    if (count > 0) world_must(run, dem2d_world_particle_stress(w, id, &stress), "particle_stress");
    if (count > 0) world_must(run, dem2d_world_get_particle(w, id, &info), "get_particle");
    if (run->script->desc.ledger) world_must(run, dem2d_world_ledger(w, &ledger), "ledger");
    world_ask_space(run);
}

/* Calls that must fail: so many of them succeed. */
static int world_fail(world_run *run) {
    dem2d_world *w = run->world;
    const dem2d_particle_id stale = {0, 1u << 30}, living = run->grains[0];
    const dem2d_vec none = {0, 0}, bad = {NAN, 0}, way = {1, 0};
    const dem2d_material_id material = run->materials[0];
    dem2d_particle_desc grain;
    dem2d_wall_desc wall;
    dem2d_pair_desc pair;
    dem2d_particle_arrays rows;
    dem2d_relaxation relaxed;
    dem2d_hit hit;
    dem2d_vec nan_row = bad;
    dem2d_particle_id id, living_row = living;
    dem2d_wall_id wall_id;
    int taken = 0, done;
    memset(&rows, 0, sizeof rows);
    rows.ids = &living_row, rows.velocities = &nan_row;
    memset(&grain, 0, sizeof grain);
    memset(&wall, 0, sizeof wall);
    memset(&pair, 0, sizeof pair);
    grain.shape = run->shapes[0];
    grain.material = wall.material = material;
    taken += dem2d_world_add_particle(w, &grain, &id) == DEM2D_OK; /* no scale */
    taken += dem2d_world_add_wall(w, &wall, &wall_id) == DEM2D_OK; /* no normal */
    taken += dem2d_world_set_wall(w, run->walls[0], &wall) == DEM2D_OK;
    taken += dem2d_world_set_pair(w, material, material, &pair) == DEM2D_OK; /* no stiffness */
    taken += dem2d_world_remove_particle(w, stale) == DEM2D_OK;
    taken += dem2d_world_move_particle(w, living, bad, 0) == DEM2D_OK;
    taken += dem2d_world_move_particle(w, living, none, 1e300) == DEM2D_OK;
    taken += dem2d_world_drive_particle(w, living, DEM2D_FIXED, way, 0) == DEM2D_OK;
    taken += dem2d_world_drive_particle(w, living, DEM2D_DRIVEN, bad, 0) == DEM2D_OK;
    taken += dem2d_world_set_gravity(w, bad) == DEM2D_OK;
    taken += dem2d_world_set_damping(w, 1, 0) == DEM2D_OK;
    taken += dem2d_world_set_time_step(w, 0) == DEM2D_OK;
    taken += dem2d_world_step(w, -1, &done) == DEM2D_OK;
    taken += dem2d_world_write_particles(w, &rows, 1) == DEM2D_OK;
    taken += dem2d_world_set_load(w, living, bad, 0) == DEM2D_OK;
    taken += dem2d_world_set_shape(w, living, run->shapes[0], 0) == DEM2D_OK;
    taken += dem2d_world_set_groups(w, stale, grain.groups) == DEM2D_OK;
    taken += dem2d_world_relax(w, 0, 3, &relaxed) == DEM2D_OK;
    taken += dem2d_world_cast_ray(w, none, none, 0, NULL, &hit) == DEM2D_OK;
    taken += dem2d_world_nearest(w, bad, 0, NULL, &hit) == DEM2D_OK;
    return taken;
}

static void world_ask_and_fail(world_run *run) {
    const uint64_t hash = dem2d_world_hash(run->world);
    scene_bytes before = scene_save(run->world);
    world_ask(run);
    scene_bytes asked = scene_save(run->world);
    if (!world_same_bytes(&before, &asked) || dem2d_world_hash(run->world) != hash)
        world_fault(run, "a query changes the world");
    if (world_fail(run) > 0) world_fault(run, "a call that must fail does not");
    scene_bytes failed = scene_save(run->world);
    if (!world_same_bytes(&before, &failed) || dem2d_world_hash(run->world) != hash)
        world_fault(run, "a failing call changes the world");
    world_met(run, WITH_QUERIES);
    free(before.bytes);
    free(asked.bytes);
    free(failed.bytes);
}

/* A new list, a step that is refused: neither may be seen. */
static void world_disturb(world_run *run) {
    if (world_once_in(&run->random, 3)) {
        inside_renew_list(run->world);
        world_met(run, WITH_LIST);
    }
    if (world_once_in(&run->random, 6)) world_refuse(run, NULL, 0, 0);
}

/* The next step, in a run that is disturbed sometimes after one that fails for want of memory. */
static dem2d_result world_step(world_run *run) {
    if (run->view.disturbed && world_once_in(&run->random, 4)) {
        const uint64_t hash = dem2d_world_hash(run->world);
        run->fail_at = 1 + random_below(&run->random, 4);
        const dem2d_result result = dem2d_world_step(run->world, 1, NULL);
        run->fail_at = 0;
        if (result != DEM2D_OUT_OF_MEMORY) return result;
        if (dem2d_world_hash(run->world) != hash && run->script->drag == 0)
            world_fault(run, "a step without memory changes the hash");
        world_met(run, WITH_MEMORY);
    }
    return dem2d_world_step(run->world, 1, NULL);
}

/* --- a script, run and compared ----------------------------------------------------------------
 */

/* Returns the number of steps that were seen. */
static int world_perform(world_run *run, world_sight sights[MOST_STEPS]) {
    const world_script *s = run->script;
    const world_view *v = &run->view;
    world_before before;
    int next = 0, step = 0;
    world_begin(run);
    for (; step < s->steps && run->fault[0] == 0; step++) {
        if (v->saved && world_once_in(&run->random, 6)) world_interrupt(run);
        for (; next < s->event_count && s->events[next].step == step; next++)
            world_event_apply(run, &s->events[next]);
        if (!inside_holds(run->world)) world_fault(run, "an invariant fails after edits");
        if (v->saved && world_once_in(&run->random, 6)) world_interrupt(run);
        if (v->asked && !run->spoiled && world_once_in(&run->random, 6)) world_ask_and_fail(run);
        if (v->disturbed) world_disturb(run);
        if (run->spoiled || run->fault[0] != 0) break;
        world_look_before(run, &before);
        sights[step].result = world_step(run);
        world_see(run, &sights[step]);
        if (!inside_holds(run->world)) world_fault(run, "an invariant fails after a step");
        if (!v->sums || sights[step].result != DEM2D_OK) continue;
        run->longest_step = fmax(run->longest_step, run->time_step);
        world_check_sums(run, &before);
        world_check_ledger(run);
    }
    world_end(run);
    if (run->fault[0] != 0) {
        char text[FAULT_ROOM];
        snprintf(text, sizeof text, "%s: step %d: %.180s", v->name, step, run->fault);
        memcpy(run->fault, text, sizeof text);
    }
    return step;
}

/* The same in all bits, or with the same hash. */
static void world_compare_exact(const world_view *v, const world_sight *plain,
                                const world_sight *other, int steps, bool hash, char *fault) {
    for (int k = 0; k < steps && fault[0] == 0; k++) {
        char name[32];
        int where;
        const double off = world_difference(&plain[k], &other[k], &where);
        const double is = world_number(&other[k], where, name);
        if (plain[k].result != other[k].result)
            snprintf(fault, FAULT_ROOM, "%s: step %d: %s, not %s", v->name, k,
                     dem2d_result_text(other[k].result), dem2d_result_text(plain[k].result));
        else if (off > 0)
            snprintf(fault, FAULT_ROOM, "%s: step %d: %s is %.17g, off by %.3g", v->name, k, name,
                     is, off);
        else if (hash && plain[k].hash != other[k].hash)
            snprintf(fault, FAULT_ROOM, "%s: step %d: the hash is another", v->name, k);
    }
}

/* Rounding may grow as a push does, a hundred times as large for safety, until chaos. Of a push and
   its opposite one finds the other side of a tie. */
static void world_compare_near(const world_view *v, double exact, const world_sight *plain,
                               world_sight pushed[2][MOST_STEPS], const world_sight *other,
                               int steps, char *fault) {
    double growth = exact;
    for (int k = 0; k < steps && fault[0] == 0; k++) {
        char name[32];
        int where;
        for (int p = 0; p < 2; p++) {
            growth = fmax(growth, world_difference(&plain[k], &pushed[p][k], &where));
            if (plain[k].result != pushed[p][k].result) return;
        }
        if (!(growth < WORLD_CHAOS)) return;
        const double off = world_difference(&plain[k], &other[k], &where);
        const double is = world_number(&other[k], where, name);
        if (plain[k].result != other[k].result)
            snprintf(fault, FAULT_ROOM, "%s: step %d: %s, not %s", v->name, k,
                     dem2d_result_text(other[k].result), dem2d_result_text(plain[k].result));
        else if (!(off <= 100 * growth))
            snprintf(fault, FAULT_ROOM, "%s: step %d: %s is %.9g, off by %.3g, rounding %.1g",
                     v->name, k, name, is, off, growth);
    }
}

static const world_view world_plain = {.name = "plain", .sums = true};
static const world_view world_pushes[2] = {{.name = "pushed", .push = WORLD_PUSH},
                                           {.name = "pushed", .push = -WORLD_PUSH}};
static const world_view world_views[] = {
    {.name = "saved", .saved = true},
    {.name = "shared", .shared = true},
    {.name = "asked", .asked = true},
    {.name = "disturbed", .disturbed = true},
    {.name = "scaled", .length = -7, .mass = 5, .time = 3},
    {.name = "mirrored", .mirrored = true},
    {.name = "turned", .turned = true},
    {.name = "reordered", .reordered = true},
};

enum { WORLD_VIEWS = sizeof world_views / sizeof *world_views };

static int world_show(const world_script *s, const world_view *view, world_sight *sights,
                      uint64_t *features, char *fault) {
    world_run run;
    memset(&run, 0, sizeof run);
    run.script = s;
    run.view = *view;
    run.random = s->seed;
    run.fault = fault;
    run.features = features;
    return world_perform(&run, sights);
}

/* What the script itself makes use of. */
static uint64_t world_uses(const world_script *s) {
    uint64_t uses = (uint64_t)1 << WITH_THREADS, one = 1;
    for (int i = 0; i < s->material_count; i++) {
        if (s->materials[i].damping_ratio > 0) uses |= one << WITH_DASHPOT;
        if (s->materials[i].rolling_friction > 0) uses |= one << WITH_ROLLING;
        if (s->materials[i].tangential_damping_ratio > 0) uses |= one << WITH_SLIDING_DASHPOT;
        if (s->materials[i].rolling_damping_ratio > 0) uses |= one << WITH_ROLLING_DASHPOT;
    }
    if (s->law) uses |= one << WITH_LAW;
    if (s->desc.faces == DEM2D_ONE_POINT) uses |= one << WITH_ONE_POINT;
    if (s->desc.solver == DEM2D_GJK_EPA) uses |= one << WITH_GJK;
    if (s->desc.skin > 0) uses |= one << WITH_SKIN;
    if (s->desc.ledger) uses |= one << WITH_LEDGER;
    if (s->desc.local_damping > 0 || s->desc.global_damping > 0) uses |= one << WITH_DAMPING;
    if (s->drag > 0) uses |= one << WITH_CALLBACK;
    if (world_in_cell(s)) uses |= one << WITH_CELL;
    for (int i = 0; i < s->grains_at_first; i++) {
        const dem2d_groups *g = &s->grains[i].groups;
        if (g->category != 0 || g->mask != 0) uses |= one << WITH_GROUPS;
        if (g->sensor) uses |= one << WITH_SENSOR;
    }
    for (int i = 0; i < s->grains_at_first; i++)
        uses |= one << (WITH_KINDS + s->shapes[s->grains[i].shape.index].type);
    return uses;
}

/* Chains and belts: at a vertex the order of the parts decides which of the two faces, and which
   belt, has the contact, and a mirror image has the other order. */
static bool world_has_order(const world_script *s) {
    for (int j = 0; j < s->wall_count; j++)
        if (s->walls[j].count > 0 || (s->walls[j].segment && s->walls[j].surface_speed != 0))
            return true;
    return false;
}

/* Does local damping act in a cell that flows? A grain that is the only free one has no velocity but
   rounding when this begins, and damping goes by its sign. */
static bool world_has_ties(const world_script *s) {
    bool flows = false, damped = s->desc.local_damping > 0;
    for (int i = 0; i < s->event_count; i++) {
        flows |= s->events[i].kind == EVENT_DEFORM;
        damped |= s->events[i].kind == EVENT_DAMPING;
    }
    return flows && damped;
}

/* One world of a seed. False when something does not hold: the first is told in fault. */
static bool world_check(uint64_t seed, int64_t index, uint64_t *features, char fault[FAULT_ROOM]) {
    static world_script s;
    static world_sight plain[MOST_STEPS], pushed[2][MOST_STEPS], other[MOST_STEPS];
    fault[0] = 0;
    world_make_script(seed, index, &s);
    *features = world_uses(&s);
    int steps = world_show(&s, &world_plain, plain, features, fault);
    for (int k = 0; k < 2 && fault[0] == 0; k++) {
        const int seen = world_show(&s, &world_pushes[k], pushed[k], features, fault);
        if (seen < steps) steps = seen;
    }
    for (int i = 0; i < WORLD_VIEWS && fault[0] == 0; i++) {
        const world_view *v = &world_views[i];
        if (v->mirrored && world_has_order(&s)) continue;
        if (v->turned && world_in_cell(&s)) continue; /* a is along x */
        if ((v->mirrored || v->reordered) && world_has_ties(&s)) continue;
        const int seen = world_show(&s, v, other, features, fault);
        if (fault[0] != 0) continue;
        if (v->mirrored || v->turned || v->reordered)
            world_compare_near(v, s.exact, plain, pushed, other, seen < steps ? seen : steps,
                               fault);
        else
            world_compare_exact(v, plain, other, seen < steps ? seen : steps,
                                v->length == 0 && !v->disturbed, fault);
    }
    return fault[0] == 0;
}

#endif
