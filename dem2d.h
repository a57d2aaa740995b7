/* dem2d.h - two-dimensional discrete element method for smooth and irregular grains, version 0.1.0

   One C99 header, no dependency but the C standard library. MIT licence (end of file).

   In ONE source file:              Everywhere else:
       #define DEM2D_IMPLEMENTATION     #include "dem2d.h"
       #include "dem2d.h"

   Link with -lm. Recommended: -O2 -fno-math-errno (same numbers, faster square roots).

CONTENTS (search for the anchor, ">>" and the word)

    Manual          what it is, limits, quick start, concepts, how-to,
                    options, errors, memory, determinism, changes           >>manual
    Declarations    version, results, vectors, poses, environment           >>api-types
                    shapes                                                  >>api-shapes
                    mass                                                    >>api-mass
                    fitting                                                 >>api-fitting
                    contact of two shapes                                   >>api-contact
                    world                                                   >>api-world
                    measures                                                >>api-measures
                    writers                                                 >>api-writers
    Implementation  compiler, constants, floating point                     >>config
                    vectors, rotations, sine and cosine                     >>math
                    allocation, log, growing arrays                         >>memory
                    convex hulls, polygon checks                            >>hull
                    trigonometric polynomials                               >>series
                    support kernels                                         >>support
                    area, centroid, polar moment                            >>mass
                    creation and questions of shapes                        >>shapes
                    templates from outlines                                 >>fitting
                    distance: Gilbert-Johnson-Keerthi                       >>gjk
                    depth: expanding polytope                               >>epa
                    contact of two shapes, of a shape and a wall            >>contact
                    candidate pairs from cell grids                         >>broad
                    spring, friction, critical time step                    >>law
                    leapfrog motion                                         >>motion
                    the world: objects, list, step                          >>world
                    energy, stress, coordination                            >>measures
                    pictures                                                >>writers
    Changes, licence                                                        >>licence

================================================================================================
>>manual

WHAT IT IS
    Grains are convex shapes in the plane: circles, ellipses, polygons (sharp or rounded), closed
    chains of cubic Bezier arcs ("polybeziers"), Fourier series of the support function (FS), or
    your own support function. They push each other with linear springs and Coulomb friction and
    move by Newton's laws. The methods are those of two papers on irregular grains:
        [P] polybezier grains: closed-form support, GJK and EPA, biaxial compression
        [F] Fourier series of the support function: convexity, reduction, fitting
    The stateless layer (shapes, mass, fitting, contact of two shapes) works without a world.

WHAT IT DOES NOT DO
    3D; concave grains (a later version joins convex parts); bonded or breaking grains; fluids;
    heat; its own threads, files of grains, windows, random numbers or clocks.

LIMITS
    * Doubles only. At most 2^30 particles. Sizes and coordinates are best within 1e-60 to 1e60.
    * A custom support function that is not convex can't be detected; contacts are then wrong.
    * One contact point for a pair. Where two long faces meet it moves with the last bits of the
      angle, so faces do not conserve energy exactly.
    * 32-bit x86 needs SSE2 (-msse2 -mfpmath=sse): the x87 rounds differently each time.
    * -ffast-math is refused: it removes NaN checks and reorders sums.

QUICK START (examples/hello.c, the same bytes)

    // Thirty grains of three shapes fall into a box and come to rest.
    #define DEM2D_IMPLEMENTATION
    #include "dem2d.h"
    #include <stdio.h>
    #include <stdlib.h>

    static void check(dem2d_result result) {
        if (result == DEM2D_OK) return;
        fprintf(stderr, "hello: %s\n", dem2d_result_text(result));
        exit(1);
    }

    int main(void) {
        dem2d_world_desc scene = {0};
        scene.time_step = 1e-4;  // s
        scene.gravity.y = -9.81; // m/s2
        scene.local_damping = 0.3;
        dem2d_world *world;
        check(dem2d_world_create(&scene, &world));

        dem2d_material_desc stone = {0};
        stone.density = 2700;         // kg/m2: kg/m3 for each metre of thickness
        stone.normal_stiffness = 1e7; // N/m
        stone.tangential_stiffness = 1e7;
        stone.friction = 0.4;
        dem2d_material_id material;
        check(dem2d_world_add_material(world, &stone, &material));

        const double normals[3][2] = {{0, 1}, {1, 0}, {-1, 0}}; // floor, left and right of 0.6 m
        for (int i = 0; i < 3; i++) {
            dem2d_wall_desc wall = {0};
            wall.material = material;
            wall.normal.x = normals[i][0], wall.normal.y = normals[i][1];
            wall.point.x = i == 2 ? 0.6 : 0;
            dem2d_wall_id id;
            check(dem2d_world_add_wall(world, &wall, &id));
        }
        const dem2d_vec corners[4] = {{0, 0}, {0.05, 0}, {0.06, 0.03}, {0.01, 0.05}};
        const double a[4] = {0.06, 0, 0.002, 0.001}, b[4] = {0, 0, 0, 0.001};
        dem2d_shape *shapes[3]; // an ellipse, a rounded polygon, a Fourier series
        dem2d_shape_id ids[3];
        check(dem2d_shape_create_ellipse(NULL, 0.035, 0.02, &shapes[0]));
        check(dem2d_shape_create_polygon(NULL, corners, 4, 0.004, &shapes[1]));
        check(dem2d_shape_create_fourier(NULL, a, b, 3, &shapes[2]));
        for (int i = 0; i < 3; i++) check(dem2d_world_add_shape(world, shapes[i], &ids[i]));
        for (int i = 0; i < 3; i++) dem2d_shape_destroy(shapes[i]); // the world has its own
        for (int i = 0; i < 30; i++) {
            dem2d_particle_desc grain = {0};
            grain.scale = 1;
            grain.shape = ids[i % 3], grain.material = material, grain.angle = i;
            grain.position.x = 0.1 + 0.1 * (i % 5), grain.position.y = 0.1 + 0.1 * (i / 5);
            dem2d_particle_id id;
            check(dem2d_world_add_particle(world, &grain, &id));
        }
        check(dem2d_world_step(world, 20000, NULL));
        check(dem2d_world_write_svg(world, &(dem2d_svg_desc){.force_chains = true}, "hello.svg"));
        dem2d_world_destroy(world);
    }

CONCEPTS
    Units       SI per metre of thickness: mass kg/m, force N/m, stress Pa, stiffness N/m per m.
                Any consistent units do; no length, area or force is built in.
    Angles      Radians, counter-clockwise. Outlines are counter-clockwise; clockwise is turned.
    Support     For a unit direction u the support point s(u) is the point of the shape farthest
                along u, h(u) = s.u the support value, rho(u) the radius of curvature there (0 at
                a corner, infinite on a flat).
    Template    A shape is created once, recentred on its centroid, and used at many poses. A
                pose is position of the centroid, rotation, and a size scale.
    Contact     The normal points from A to B. depth = min over u of h_A(u) + h_B(-u) - d.u with
                d the vector from A's centre to B's; positive is overlap, negative a gap. The
                true depth lies between depth - error and depth.
    Wall        A half-plane: its normal points into the grains. It stands still, moves at a
                velocity, or is servo-controlled to a stress.
    Force       On B along the normal: kn depth (never attractive). Along the tangent an
                incremental spring kt, at most friction times the normal force ([F] eq. 8-10).
    Step        Positions are at step n, velocities half a step earlier (leapfrog). Contacts,
                forces, energies and stresses are those of the last force pass: at the positions
                before the last move. Kinetic energy is the mean of the two half steps around it.
    Damping     local (Cundall): each force component reduced by alpha |F| sign(v).
                global viscous: v <- ((1 - xi dt/2) v + dt F/m) / (1 + xi dt/2).
    Stress      Compression positive.

HOW TO
    make a shape         dem2d_shape_create_*; give it to a world with dem2d_world_add_shape
                         (the world keeps a copy: destroy yours at any time).
    get one from a grain dem2d_fourier_fit, dem2d_fourier_reduce, dem2d_shape_create_fourier; or
                         dem2d_bezier_fit, dem2d_shape_create_bezier.
    test two shapes      dem2d_pair_overlap (yes or no), dem2d_pair_distance (gap, witness
                         points), dem2d_pair_contact (gap or depth, normal, contact point).
                         Pass the last normal as desc.start when the pair has moved little.
    choose a time step   dem2d_world_time_step_bounds on a settled scene. The world checks it
                         whenever it renews its list of pairs.
    stop friction        dem2d_world_set_pair for the two materials.
    hold a stress        a wall with mode DEM2D_WALL_SERVO, stress, and a length: constant or the
                         distance between two other walls.
    draw                 dem2d_world_write_svg, or dem2d_shape_outline for your own pictures.

OPTIONS (zero means: physical zero for physical fields; "library default" where one is given)
    struct                  field                 unit   default    range
    dem2d_env               user                  -      NULL       handed to the callbacks
    dem2d_env               allocate              -      malloc     both or neither
    dem2d_env               release               -      free       both or neither
    dem2d_env               log                   -      silent
    dem2d_custom_desc       support               -      none       required
    dem2d_custom_desc       user                  -      NULL
    dem2d_custom_desc       rho_min               m      0          >= 0
    dem2d_custom_desc       inscribed             m      0          >= 0
    dem2d_custom_desc       mass                  m2,m4  computed   area 0: from outline_points
    dem2d_custom_desc       outline_points        -      1000       0 or >= 3
    dem2d_reduction_desc    test                  -      SUFFICIENT
    dem2d_reduction_desc    factor                -      0.9        0 or inside (0, 1)
    dem2d_reduction_desc    tolerance             -      1e-6       >= 0, relative to a0
    dem2d_contact_desc      tolerance             -      1e-10      >= 0, of R_A + R_B + |d|
    dem2d_contact_desc      max_iterations        -      128        >= 0
    dem2d_contact_desc      start                 -      centres    any direction
    dem2d_world_desc        time_step             s      none       > 0
    dem2d_world_desc        gravity               m/s2   0          finite
    dem2d_world_desc        local_damping         -      0          [0, 1)
    dem2d_world_desc        global_damping        1/s    0          >= 0
    dem2d_world_desc        skin                  -      0.1        >= 0, of the particle radius
    dem2d_world_desc        contact_tolerance     -      1e-8       >= 0, of R_A + R_B + |d|
    dem2d_world_desc        max_iterations        -      128        >= 0
    dem2d_world_desc        particle_capacity     -      grows      >= 0
    dem2d_world_desc        pair_capacity         -      grows      >= 0
    dem2d_world_desc        skip_time_step_check  -      false
    dem2d_world_desc        env                   -      NULL       copied
    dem2d_material_desc     density               kg/m2  none       > 0 (walls ignore it)
    dem2d_material_desc     normal_stiffness      N/m    none       > 0
    dem2d_material_desc     tangential_stiffness  N/m    0          >= 0
    dem2d_material_desc     friction              -      0          >= 0
    dem2d_pair_desc         normal_stiffness      N/m    none       > 0
    dem2d_pair_desc         tangential_stiffness  N/m    0          >= 0
    dem2d_pair_desc         friction              -      0          >= 0
    dem2d_particle_desc     scale                 -      none       > 0
    dem2d_particle_desc     shape                 -      none       a shape of this world
    dem2d_particle_desc     material              -      none       a material of this world
    dem2d_particle_desc     motion                -      FREE
    dem2d_particle_desc     position              m      0          finite
    dem2d_particle_desc     angle                 rad    0          finite
    dem2d_particle_desc     velocity              m/s    0          finite; 0 when FIXED
    dem2d_particle_desc     angular_velocity      rad/s  0          finite; 0 when FIXED
    dem2d_wall_desc         length                m      none       > 0 for a servo with no spans
    dem2d_wall_desc         mode                  -      STILL
    dem2d_wall_desc         material              -      none       a material of this world
    dem2d_wall_desc         point                 m      0          finite
    dem2d_wall_desc         normal                -      none       not zero; normalised
    dem2d_wall_desc         velocity              m/s    0          finite; MOVING only
    dem2d_wall_desc         stress                Pa     0          finite; SERVO only
    dem2d_wall_desc         max_speed             m/s    none       > 0 for SERVO
    dem2d_wall_desc         spans                 -      none       two walls, or both zero
    dem2d_svg_desc          width                 px     800        >= 0
    dem2d_svg_desc          outline_points        -      64         0 or >= 3
    dem2d_svg_desc          force_chains          -      false
    dem2d_svg_desc          write                 -      none       or a path, not both
    dem2d_svg_desc          user                  -      NULL

ERRORS
    Functions that can fail return a dem2d_result; dem2d_result_text gives its text. Outputs are
    written only on success, and a failing call leaves everything as it was. The log callback of
    the environment gets the particulars: which field, which value, which index. A step that fails
    (non-finite state, no memory, time step too long) leaves the world before that step.
    Contact queries return a state and never a guess: DEM2D_NOT_CONVERGED comes with the bound
    that was reached.

MEMORY
    All of it comes through dem2d_env (malloc and free by default); release gets the size. Nothing
    is allocated in a step once the list of pairs has stopped growing; dem2d_world_stats tells the
    bytes in use. Give capacities to reserve beforehand.

DETERMINISM
    Same input, same bits: on gcc and clang, C and C++, -O0 to -O3, with or without FMA hardware
    (contraction is off inside this header). Steps use only + - * / and sqrt; sine, cosine and
    arctangent are the header's own. A pair is (lower id, higher id) and forces are summed in the
    order of the partner's id, so neither addresses nor storage order can change a bit. Not
    covered: clang -ffp-contract=fast on the command line, and 80-bit x87 arithmetic.
    gcc does not inline across the header's floating-point region: calls into it stay calls.
================================================================================================
*/

#ifndef DEM2D_H
#define DEM2D_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* ============================================================================================
   >>api-types  Version, results, vectors, poses, environment
   ============================================================================================ */

#define DEM2D_VERSION_MAJOR 0
#define DEM2D_VERSION_MINOR 1
#define DEM2D_VERSION_PATCH 0
#define DEM2D_VERSION 100 /* major * 10000 + minor * 100 + patch */
#define DEM2D_VERSION_STRING "0.1.0"

#if defined(DEM2D_STATIC)
#if defined(__GNUC__)
#define DEM2D_API static __attribute__((unused))
#else
#define DEM2D_API static
#endif
#else
#define DEM2D_API extern
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Every result and its text. */
#define DEM2D_RESULTS(X)                                                                        \
    X(OK, "no error")                                                                           \
    X(NULL_ARGUMENT, "a required pointer is NULL")                                              \
    X(NOT_FINITE, "a number is not finite")                                                     \
    X(OUT_OF_RANGE, "a number is outside its range")                                            \
    X(OUT_OF_MEMORY, "the allocator returned NULL")                                             \
    X(TOO_FEW_POINTS, "too few points")                                                         \
    X(DUPLICATE_POINT, "two neighbouring points coincide")                                      \
    X(NOT_CONVEX, "the outline is not convex")                                                  \
    X(ZERO_AREA, "the area is zero")                                                            \
    X(NOT_SMOOTH, "two arcs do not share their tangent")                                        \
    X(NEGATIVE_CURVATURE, "the radius of curvature is negative somewhere")                      \
    X(STALE_ID, "the id does not name a living object of this world")                           \
    X(IN_USE, "the object is still used by another")                                            \
    X(TIME_STEP, "the time step is above the stable limit")                                     \
    X(NOT_CONVERGED, "a contact search reached its cap of iterations")                          \
    X(STATE, "the step would give a state that is not finite")                                  \
    X(IO, "writing failed")

/// Result of a function that can fail: DEM2D_OK (0) or the reason.
typedef enum dem2d_result {
#define DEM2D_RESULT_NAME(name, text) DEM2D_##name,
    DEM2D_RESULTS(DEM2D_RESULT_NAME)
#undef DEM2D_RESULT_NAME
    DEM2D_RESULT_COUNT ///< number of results, not a result
} dem2d_result;

/// Point or vector in the plane.
typedef struct dem2d_vec {
    double x; ///< first component
    double y; ///< second component
} dem2d_vec;

/// Rotation as cosine and sine; {1, 0} turns by nothing.
typedef struct dem2d_rot {
    double c; ///< cosine
    double s; ///< sine
} dem2d_rot;

/// Where a shape is: its points x become position + scale * (rotation of x).
typedef struct dem2d_pose {
    dem2d_vec position; ///< of the centroid, m
    dem2d_rot rotation; ///< a unit pair
    double scale;       ///< size factor, > 0
} dem2d_pose;

/// Memory and messages. NULL wherever one is taken means malloc, free and silence.
typedef struct dem2d_env {
    void *user;                                 ///< handed to the callbacks
    void *(*allocate)(void *user, size_t size); ///< as malloc; NULL: malloc
    /// As free, with the size that was asked for; NULL: free.
    void (*release)(void *user, void *memory, size_t size);
    /// Particulars of an error or a warning; index is the offending point, arc or object, or -1.
    void (*log)(void *user, dem2d_result result, int index, const char *text);
} dem2d_env;

/// Version of the implementation: DEM2D_VERSION when header and implementation agree.
DEM2D_API int dem2d_version(void);
/// One-line text of a result; never NULL.
DEM2D_API const char *dem2d_result_text(dem2d_result result);
/// Rotation by an angle in radians, |angle| at most 2^30; the same bits on every platform.
DEM2D_API dem2d_rot dem2d_rot_make(double angle);
/// Angle of a rotation in (-pi, pi]; the same bits on every platform.
DEM2D_API double dem2d_rot_angle(dem2d_rot rotation);
/// Pose from position (m), angle (radians) and scale.
DEM2D_API dem2d_pose dem2d_pose_make(double x, double y, double angle, double scale);

/* ============================================================================================
   >>api-shapes  Convex shapes, stateless: creation, support, questions
   ============================================================================================ */

/// A convex template about its centroid. Opaque; not changed after creation.
typedef struct dem2d_shape dem2d_shape;

/// What a shape is made of.
typedef enum dem2d_shape_type {
    DEM2D_CIRCLE,  ///< radius
    DEM2D_ELLIPSE, ///< two half axes
    DEM2D_POLYGON, ///< convex, sharp or rounded
    DEM2D_BEZIER,  ///< closed chain of cubic Bezier arcs
    DEM2D_FOURIER, ///< Fourier series of the support function
    DEM2D_CUSTOM,  ///< the caller's support function
    DEM2D_SHAPE_TYPE_COUNT
} dem2d_shape_type;

/// Area, centroid and polar moment of area about the centroid. Times density: mass and inertia.
typedef struct dem2d_mass {
    double area;         ///< m2
    dem2d_vec centroid;  ///< m
    double polar_moment; ///< m4, about the centroid
} dem2d_mass;

/// Support function of a custom shape: the point farthest along the unit direction, in the shape's
/// own coordinates. If rho is not NULL, the radius of curvature there is stored in it.
typedef dem2d_vec dem2d_support_fn(void *user, dem2d_vec direction, double *rho);

/// Custom shape.
typedef struct dem2d_custom_desc {
    dem2d_support_fn *support; ///< convex support function; required
    void *user;                ///< handed to it
    double rho_min;            ///< m, a lower bound of the radius of curvature; 0 if unknown
    double inscribed;          ///< m, radius of a disc about the centroid inside; 0 if unknown
    dem2d_mass mass;           ///< if area > 0, taken as given; otherwise from outline points
    int outline_points;        ///< for the mass, 0 for 1000
} dem2d_custom_desc;

/// What a shape is, as a template (scale 1, about its centroid).
typedef struct dem2d_shape_info {
    dem2d_shape_type type;  ///< which model
    int count;              ///< vertices, arcs or order; 0 otherwise
    double rounding;        ///< m, rounding radius of a polygon
    dem2d_mass mass;        ///< exact; the centroid is 0
    dem2d_vec offset;       ///< m, centroid of the data given at creation
    double circumscribed;   ///< m, radius of the bounding circle about the centroid
    double inscribed;       ///< m, radius of the inscribed circle about the centroid
    double rho_min;         ///< m, lower bound of the radius of curvature; 0 with corners
    double equivalent;      ///< m, radius of the circle of equal area
    size_t bytes;           ///< memory of the template
} dem2d_shape_info;

/// Axis-aligned box.
typedef struct dem2d_box {
    dem2d_vec lower; ///< least x and y
    dem2d_vec upper; ///< greatest x and y
} dem2d_box;

/// Answer of a support query in the direction asked for, normalised.
typedef struct dem2d_support {
    dem2d_vec point;     ///< m, farthest point
    dem2d_vec direction; ///< the unit direction
    double value;        ///< m, point . direction, relative to the pose's position
    double rho;          ///< m, radius of curvature; 0 at a corner, HUGE_VAL on a flat
} dem2d_support;

/// Circle. radius > 0. Errors: NOT_FINITE, ZERO_AREA (radius 0), OUT_OF_RANGE (negative).
DEM2D_API dem2d_result dem2d_shape_create_circle(const dem2d_env *env, double radius,
                                                 dem2d_shape **shape);
/// Ellipse with half axes a along x and b along y, both > 0. Errors as for a circle.
DEM2D_API dem2d_result dem2d_shape_create_ellipse(const dem2d_env *env, double a, double b,
                                                  dem2d_shape **shape);
/// Convex polygon of count >= 3 points, grown by a rounding radius >= 0. Clockwise input is turned,
/// points on an edge (to rounding) are dropped. Errors: NOT_FINITE, TOO_FEW_POINTS,
/// DUPLICATE_POINT, NOT_CONVEX, ZERO_AREA, OUT_OF_RANGE.
DEM2D_API dem2d_result dem2d_shape_create_polygon(const dem2d_env *env, const dem2d_vec *points,
                                                  int count, double rounding,
                                                  dem2d_shape **shape);
/// Closed chain of cubic Bezier arcs: control[3 * arcs], arc i uses points 3i .. 3i + 3 (cyclic).
/// arcs >= 2; each arc convex, turning by at most pi, neighbours with one tangent (G1), one turn
/// in all. Clockwise is turned. Errors: NOT_FINITE, TOO_FEW_POINTS, NOT_CONVEX, NOT_SMOOTH,
/// ZERO_AREA. ([P] sec. 2; M3 = M4 = 0 allowed.)
DEM2D_API dem2d_result dem2d_shape_create_bezier(const dem2d_env *env, const dem2d_vec *control,
                                                 int arcs, dem2d_shape **shape);
/// Support function p(t) = a[0]/2 + sum over n = 1..order of a[n] cos nt + b[n] sin nt; a and b
/// have order + 1 elements, b[0] is not read. p + p'' must nowhere be negative. Errors:
/// NOT_FINITE, OUT_OF_RANGE (order < 0), ZERO_AREA, NEGATIVE_CURVATURE. ([F] sec. 2)
DEM2D_API dem2d_result dem2d_shape_create_fourier(const dem2d_env *env, const double *a,
                                                  const double *b, int order,
                                                  dem2d_shape **shape);
/// The caller's support function. Its bounding circle comes from four calls, mass from
/// outline points unless given. Errors: NOT_FINITE, OUT_OF_RANGE, ZERO_AREA.
DEM2D_API dem2d_result dem2d_shape_create_custom(const dem2d_env *env,
                                                 const dem2d_custom_desc *desc,
                                                 dem2d_shape **shape);
/// Release a shape; NULL is allowed.
DEM2D_API void dem2d_shape_destroy(dem2d_shape *shape);
/// Facts about a template.
DEM2D_API dem2d_result dem2d_shape_get(const dem2d_shape *shape, dem2d_shape_info *info);
/// Support point in any finite direction but zero, of any length. Errors: NOT_FINITE,
/// OUT_OF_RANGE (zero direction, scale not above 0).
DEM2D_API dem2d_result dem2d_shape_support(const dem2d_shape *shape, dem2d_pose pose,
                                           dem2d_vec direction, dem2d_support *support);
/// Axis-aligned bounding box at a pose (exact: four support values).
DEM2D_API dem2d_result dem2d_shape_aabb(const dem2d_shape *shape, dem2d_pose pose,
                                        dem2d_box *box);
/// count >= 3 points on the boundary, counter-clockwise: smooth shapes by uniform directions,
/// polybeziers by uniform parameter, polygons by uniform length. Errors: TOO_FEW_POINTS,
/// NOT_FINITE, OUT_OF_RANGE.
DEM2D_API dem2d_result dem2d_shape_outline(const dem2d_shape *shape, dem2d_pose pose, int count,
                                           dem2d_vec *points);

/* ============================================================================================
   >>api-mass  Area, centroid, polar moment
   ============================================================================================ */

/// Of a simple polygon of count >= 3 points, either orientation, about its centroid ([P] eq.
/// 10-11 with the missing - m |c|^2). Errors: TOO_FEW_POINTS, NOT_FINITE, ZERO_AREA.
DEM2D_API dem2d_result dem2d_polygon_mass(const dem2d_vec *points, int count, dem2d_mass *mass);
/// Of a template, exact to round-off (custom shapes: as created).
DEM2D_API dem2d_result dem2d_shape_mass(const dem2d_shape *shape, dem2d_mass *mass);
/// Of a template by the polygon through count >= 3 outline points ([P] eq. 10-11): the error
/// falls as 1/count^2. Allocates nothing.
DEM2D_API dem2d_result dem2d_shape_mass_interpolated(const dem2d_shape *shape, int count,
                                                     dem2d_mass *mass);

/* ============================================================================================
   >>api-fitting  Templates from outlines
   ============================================================================================ */

/// How the coefficient reduction tests convexity.
typedef enum dem2d_convexity_test {
    DEM2D_SUFFICIENT, ///< [F] eq. 7: a0/2 >= sum (n^2 - 1) |c_n|; safe, far too strict
    DEM2D_EXACT,      ///< rigorous minimum of rho >= 0
    DEM2D_NO_TEST     ///< leave the series as it is
} dem2d_convexity_test;

/// Reduction of FS coefficients until the shape is convex.
typedef struct dem2d_reduction_desc {
    dem2d_convexity_test test; ///< when to stop
    double factor;             ///< on the highest pair left, inside (0, 1); 0 for 0.9
    double tolerance;          ///< of a0: smaller pairs become 0; 0 for 1e-6
} dem2d_reduction_desc;

/// Convexity of a Fourier series of a support function.
typedef struct dem2d_convexity {
    double sufficient_margin; ///< m, a0/2 - sum (n^2 - 1) |c_n|: >= 0 proves convexity
    double rho_min_lower;     ///< m, rigorous lower bound of the least radius of curvature
    double rho_min_upper;     ///< m, a value of rho that is attained (to rounding)
    bool sufficient;          ///< [F] eq. 7 holds
    bool exact;               ///< rho_min_lower >= -rounding: a shape can be created
} dem2d_convexity;

/// Convex hull of count points (Andrew's monotone chain), counter-clockwise, no collinear points.
/// hull has room for count points. Errors: TOO_FEW_POINTS (also for a hull below 3), NOT_FINITE,
/// OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_polygon_hull(const dem2d_env *env, const dem2d_vec *points,
                                          int count, dem2d_vec *hull, int *hull_count);
/// FS of an outline ([F] sec. 2.3): hull, `samples` uniform support values, least squares.
/// a and b get order + 1 values; samples > 2 order, 0 for 16 order + 64. The series may be
/// non-convex: dem2d_fourier_reduce. Errors: TOO_FEW_POINTS, NOT_FINITE, OUT_OF_RANGE, ZERO_AREA,
/// OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_fourier_fit(const dem2d_env *env, const dem2d_vec *points, int count,
                                         int order, int samples, double *a, double *b);
/// Convexity of a series of this order: sufficient and exact test.
DEM2D_API dem2d_result dem2d_fourier_convexity(const double *a, const double *b, int order,
                                               dem2d_convexity *convexity);
/// The paper's reduction ([F] sec. 2.3): the highest pair above the tolerance is multiplied by the
/// factor until the test holds. Changes a and b in place; reductions (may be NULL) gets the
/// number of multiplications. Errors: NOT_FINITE, OUT_OF_RANGE, ZERO_AREA (a0 not above 0).
DEM2D_API dem2d_result dem2d_fourier_reduce(double *a, double *b, int order,
                                            const dem2d_reduction_desc *desc, int *reductions);
/// Polybezier of an outline ([P] sec. 4): joints are support points of the hull in `arcs` >= 3
/// uniform directions, tangents are perpendicular to them, and the two lengths of each arc
/// minimise the exact area between arc and outline. control gets 3 * arcs points. Errors:
/// TOO_FEW_POINTS, NOT_FINITE, OUT_OF_RANGE, ZERO_AREA, OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_bezier_fit(const dem2d_env *env, const dem2d_vec *points, int count,
                                        int arcs, dem2d_vec *control);

/* ============================================================================================
   >>api-contact  Contact of two shapes, of a shape and a wall
   ============================================================================================ */

/// What is known of a pair.
typedef enum dem2d_contact_state {
    DEM2D_SEPARATED,   ///< a gap, above rounding
    DEM2D_TOUCHING,    ///< gap or overlap within rounding of the sizes
    DEM2D_PENETRATING, ///< an overlap, above rounding
    DEM2D_UNRESOLVED   ///< the cap of iterations was reached; depth and error are still bounds
} dem2d_contact_state;

/// How a pair is searched. All zero is fine.
typedef struct dem2d_contact_desc {
    double tolerance;   ///< of R_A + R_B + |d|: stop when the error is below; 0 for 1e-10
    int max_iterations; ///< of GJK and of EPA each; 0 for 128
    dem2d_vec start;    ///< first direction, the last normal for instance; 0 for line of centres
} dem2d_contact_desc;

/// Answer to a contact query, in the coordinates of the poses.
typedef struct dem2d_contact {
    dem2d_contact_state state; ///< see there
    int support_calls;         ///< evaluations of the support of A minus B
    int iterations;            ///< of GJK and EPA together
    dem2d_vec normal;          ///< unit, from A to B
    double depth;              ///< m, overlap along the normal; negative: minus the gap
    double error;              ///< m, the true depth is in [depth - error, depth]
    dem2d_vec point_a;         ///< m, witness point on A
    dem2d_vec point_b;         ///< m, witness point on B
    dem2d_vec point;           ///< m, contact point: the middle of the two
} dem2d_contact;

/// Whether a point lies in a shape (boundary included, to rounding).
DEM2D_API dem2d_result dem2d_shape_contains(const dem2d_shape *shape, dem2d_pose pose,
                                            dem2d_vec point, bool *inside);
/// Do two shapes overlap? GJK stopped at the first direction that separates them or the first
/// simplex that holds the origin ([P], [F] sec. 3). Only state, counts, and bounds are
/// meaningful: depth is the least support value met and error its distance to a lower bound.
DEM2D_API dem2d_result dem2d_pair_overlap(const dem2d_shape *a, dem2d_pose pose_a,
                                          const dem2d_shape *b, dem2d_pose pose_b,
                                          const dem2d_contact_desc *desc,
                                          dem2d_contact *contact);
/// Distance by GJK: gap, normal and witness points of separated shapes. Overlapping shapes get
/// the answer of dem2d_pair_overlap. desc may be NULL.
DEM2D_API dem2d_result dem2d_pair_distance(const dem2d_shape *a, dem2d_pose pose_a,
                                           const dem2d_shape *b, dem2d_pose pose_b,
                                           const dem2d_contact_desc *desc,
                                           dem2d_contact *contact);
/// Distance or depth: GJK, then EPA when they overlap. Two circles take the closed form (0
/// support calls). desc may be NULL.
DEM2D_API dem2d_result dem2d_pair_contact(const dem2d_shape *a, dem2d_pose pose_a,
                                          const dem2d_shape *b, dem2d_pose pose_b,
                                          const dem2d_contact_desc *desc,
                                          dem2d_contact *contact);
/// Shape A against a half-plane B: one support call, exact. `point` is on the wall's surface,
/// `wall_normal` (any length but 0) points out of the wall, towards the shapes.
DEM2D_API dem2d_result dem2d_wall_contact(const dem2d_shape *shape, dem2d_pose pose,
                                          dem2d_vec point, dem2d_vec wall_normal,
                                          dem2d_contact *contact);

/* ============================================================================================
   >>api-world  Particles, walls, materials, steps
   ============================================================================================ */

/// A scene. Opaque.
typedef struct dem2d_world dem2d_world;

/// Handle of a template in a world. Generation 0 is never valid.
typedef struct dem2d_shape_id {
    uint32_t index;      ///< slot
    uint32_t generation; ///< of the slot
} dem2d_shape_id;
/// Handle of a material.
typedef struct dem2d_material_id {
    uint32_t index;      ///< slot
    uint32_t generation; ///< of the slot
} dem2d_material_id;
/// Handle of a particle.
typedef struct dem2d_particle_id {
    uint32_t index;      ///< slot
    uint32_t generation; ///< of the slot
} dem2d_particle_id;
/// Handle of a wall.
typedef struct dem2d_wall_id {
    uint32_t index;      ///< slot
    uint32_t generation; ///< of the slot
} dem2d_wall_id;

/// A world. Only time_step has no default.
typedef struct dem2d_world_desc {
    double time_step;          ///< s, > 0
    dem2d_vec gravity;         ///< m/s2
    double local_damping;      ///< Cundall's factor, [0, 1)
    double global_damping;     ///< 1/s, viscous, >= 0
    double skin;               ///< of the particle radius: reach of the pair list; 0 for 0.1
    double contact_tolerance;  ///< of R_A + R_B + |d|; 0 for 1e-8
    int max_iterations;        ///< of GJK and EPA; 0 for 128
    int particle_capacity;     ///< reserved at creation; 0 grows
    int pair_capacity;         ///< reserved at creation; 0 grows
    bool skip_time_step_check; ///< no stability check
    const dem2d_env *env;      ///< memory and log, copied; NULL for malloc, free, silence
} dem2d_world_desc;

/// A material. Two materials meet with the harmonic mean of their stiffnesses (springs in
/// series, doubled) and the smaller friction, unless dem2d_world_set_pair says otherwise.
typedef struct dem2d_material_desc {
    double density;              ///< kg/m2 (kg/m3 per metre of thickness), > 0
    double normal_stiffness;     ///< N/m, > 0
    double tangential_stiffness; ///< N/m, >= 0
    double friction;             ///< coefficient, >= 0
} dem2d_material_desc;

/// How two materials meet.
typedef struct dem2d_pair_desc {
    double normal_stiffness;     ///< N/m, > 0
    double tangential_stiffness; ///< N/m, >= 0
    double friction;             ///< coefficient, >= 0
} dem2d_pair_desc;

/// How a particle moves.
typedef enum dem2d_motion {
    DEM2D_FREE,  ///< by the forces on it
    DEM2D_FIXED, ///< not at all
    DEM2D_DRIVEN ///< at the velocities it was given, whatever the forces
} dem2d_motion;

/// A particle. Errors name the field.
typedef struct dem2d_particle_desc {
    double scale;                ///< size factor on the template, > 0
    dem2d_shape_id shape;        ///< template
    dem2d_material_id material;  ///< material
    dem2d_motion motion;         ///< free, fixed or driven
    dem2d_vec position;          ///< m, of the centroid
    double angle;                ///< rad
    dem2d_vec velocity;          ///< m/s, half a step before the position
    double angular_velocity;     ///< rad/s
} dem2d_particle_desc;

/// State of a particle.
typedef struct dem2d_particle_info {
    dem2d_shape_id shape;       ///< template
    dem2d_material_id material; ///< material
    dem2d_motion motion;        ///< free, fixed or driven
    dem2d_pose pose;            ///< now
    dem2d_vec velocity;         ///< m/s, half a step before the pose
    double angular_velocity;    ///< rad/s
    dem2d_vec force;            ///< N/m, sum of contacts in the last force pass (no gravity)
    double torque;              ///< N, likewise, about the centroid
    double mass;                ///< kg/m
    double inertia;             ///< kg m, about the centroid
    double radius;              ///< m, bounding circle
    double equivalent;          ///< m, radius of the circle of equal area
} dem2d_particle_info;

/// How a wall moves.
typedef enum dem2d_wall_mode {
    DEM2D_WALL_STILL,  ///< not at all
    DEM2D_WALL_MOVING, ///< at a given velocity
    DEM2D_WALL_SERVO   ///< along its normal, so that force = stress * length
} dem2d_wall_mode;

/// A half-plane.
typedef struct dem2d_wall_desc {
    double length;              ///< m, for stress; ignored when spans are given
    dem2d_wall_mode mode;       ///< still, moving, servo
    dem2d_material_id material; ///< friction and stiffness (its density is not used)
    dem2d_vec point;            ///< m, on the surface
    dem2d_vec normal;           ///< out of the wall, towards the grains; any length but 0
    dem2d_vec velocity;         ///< m/s, for MOVING
    double stress;              ///< Pa, for SERVO, compression positive
    double max_speed;           ///< m/s, for SERVO, > 0
    dem2d_wall_id spans[2];     ///< the length is the distance between these walls; or both zero
} dem2d_wall_desc;

/// State of a wall.
typedef struct dem2d_wall_info {
    dem2d_wall_mode mode;       ///< still, moving, servo
    dem2d_material_id material; ///< as given
    dem2d_vec point;            ///< m, on the surface, now
    dem2d_vec normal;           ///< unit, towards the grains
    dem2d_vec velocity;         ///< m/s, half a step before the point
    dem2d_vec force;            ///< N/m, of the particles on the wall in the last force pass
    double length;              ///< m, at the last force pass; 0 when neither length nor spans
    double stress;              ///< Pa, -force . normal / length; 0 when there is no length
    double target;              ///< Pa, for SERVO
} dem2d_wall_info;

/// One contact of the last force pass.
typedef struct dem2d_contact_info {
    dem2d_particle_id a;        ///< particle A
    dem2d_particle_id b;        ///< particle B; generation 0 when B is a wall
    dem2d_wall_id wall;         ///< wall B; generation 0 when B is a particle
    dem2d_vec normal;           ///< unit, from A to B
    dem2d_vec point;            ///< m, contact point
    dem2d_vec branch;           ///< m, centre of A to centre of B (wall: to the contact point)
    double depth;               ///< m, overlap
    double normal_force;        ///< N/m, on B along the normal, >= 0
    double tangential_force;    ///< N/m, on B along the normal turned by +90 degrees
} dem2d_contact_info;

/// Counters of a world.
typedef struct dem2d_stats {
    int64_t steps;          ///< done since creation
    int64_t list_rebuilds;  ///< of the pair list
    int64_t support_calls;  ///< in all steps
    int64_t not_converged;  ///< contacts whose search reached its cap, in all steps
    int64_t slow_time_step; ///< checks that found the time step above the safe bound
    int particles;          ///< alive
    int walls;              ///< alive
    int pairs;              ///< in the list, walls included
    int contacts;           ///< between particles in the last force pass
    int wall_contacts;      ///< with walls in the last force pass
    size_t bytes;           ///< in use, all of the world
} dem2d_stats;

/// Create a world. Errors: NULL_ARGUMENT, NOT_FINITE, OUT_OF_RANGE, OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_world_create(const dem2d_world_desc *desc, dem2d_world **world);
/// Release a world and all in it; NULL is allowed.
DEM2D_API void dem2d_world_destroy(dem2d_world *world);
/// Copy a template into the world.
DEM2D_API dem2d_result dem2d_world_add_shape(dem2d_world *world, const dem2d_shape *shape,
                                             dem2d_shape_id *id);
/// Remove a template that no particle uses (else IN_USE).
DEM2D_API dem2d_result dem2d_world_remove_shape(dem2d_world *world, dem2d_shape_id id);
/// The world's copy of a template; valid until it is removed. NULL for a stale id.
DEM2D_API const dem2d_shape *dem2d_world_shape(const dem2d_world *world, dem2d_shape_id id);
/// Add a material. At most 256. Errors: NOT_FINITE, OUT_OF_RANGE, OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_world_add_material(dem2d_world *world,
                                                const dem2d_material_desc *desc,
                                                dem2d_material_id *id);
/// Say how two materials (or one with itself) meet from now on.
DEM2D_API dem2d_result dem2d_world_set_pair(dem2d_world *world, dem2d_material_id a,
                                            dem2d_material_id b, const dem2d_pair_desc *desc);
/// Add a particle.
DEM2D_API dem2d_result dem2d_world_add_particle(dem2d_world *world,
                                                const dem2d_particle_desc *desc,
                                                dem2d_particle_id *id);
/// Remove a particle and its contacts.
DEM2D_API dem2d_result dem2d_world_remove_particle(dem2d_world *world, dem2d_particle_id id);
/// State of a particle.
DEM2D_API dem2d_result dem2d_world_get_particle(const dem2d_world *world, dem2d_particle_id id,
                                                dem2d_particle_info *info);
/// Put a particle elsewhere; its contacts start afresh.
DEM2D_API dem2d_result dem2d_world_move_particle(dem2d_world *world, dem2d_particle_id id,
                                                 dem2d_vec position, double angle);
/// Give a particle other velocities (m/s, rad/s) and another kind of motion.
DEM2D_API dem2d_result dem2d_world_drive_particle(dem2d_world *world, dem2d_particle_id id,
                                                  dem2d_motion motion, dem2d_vec velocity,
                                                  double angular_velocity);
/// Add a wall.
DEM2D_API dem2d_result dem2d_world_add_wall(dem2d_world *world, const dem2d_wall_desc *desc,
                                            dem2d_wall_id *id);
/// Replace a wall's description; its contacts stay if the point is near where it was.
DEM2D_API dem2d_result dem2d_world_set_wall(dem2d_world *world, dem2d_wall_id id,
                                            const dem2d_wall_desc *desc);
/// Remove a wall that no other wall spans to (else IN_USE).
DEM2D_API dem2d_result dem2d_world_remove_wall(dem2d_world *world, dem2d_wall_id id);
/// State of a wall.
DEM2D_API dem2d_result dem2d_world_get_wall(const dem2d_world *world, dem2d_wall_id id,
                                            dem2d_wall_info *info);
/// Change gravity (m/s2).
DEM2D_API dem2d_result dem2d_world_set_gravity(dem2d_world *world, dem2d_vec gravity);
/// Change local ([0, 1)) and global (1/s, >= 0) damping.
DEM2D_API dem2d_result dem2d_world_set_damping(dem2d_world *world, double local, double global);
/// Change the time step (s, > 0).
DEM2D_API dem2d_result dem2d_world_set_time_step(dem2d_world *world, double time_step);
/// Bounds of the stable time step for the contacts open in the last force pass: at or below
/// `safe` it is stable, above `limit` it is not (s; HUGE_VAL for limit without contacts; without
/// contacts `safe` counts one contact per particle). limit_particle (may be NULL) is the particle
/// that sets the limit, generation 0 if none.
DEM2D_API dem2d_result dem2d_world_time_step_bounds(const dem2d_world *world, double *safe,
                                                    double *limit,
                                                    dem2d_particle_id *limit_particle);
/// Take count >= 0 steps; done (may be NULL) gets the number taken, also on failure. Errors: STATE,
/// TIME_STEP, OUT_OF_MEMORY, OUT_OF_RANGE: the world is as before the step that failed.
DEM2D_API dem2d_result dem2d_world_step(dem2d_world *world, int count, int *done);

/* ============================================================================================
   >>api-measures  Queries: lists, energy, stress, coordination
   ============================================================================================ */

/// Energies of the last force pass, J/m.
typedef struct dem2d_energy {
    double translational; ///< kinetic, mean of the half steps before and after
    double rotational;    ///< likewise
    double normal;        ///< in normal springs
    double tangential;    ///< in tangential springs
    double potential;     ///< -sum m g.x
} dem2d_energy;

/// Stress tensor, compression positive, Pa.
typedef struct dem2d_stress {
    double xx; ///< normal, x
    double xy; ///< force along y across a face with normal x
    double yx; ///< force along x across a face with normal y
    double yy; ///< normal, y
} dem2d_stress;

/// Numbers of a packing at the last force pass.
typedef struct dem2d_packing {
    double coordination;        ///< contacting neighbours per particle, walls not counted
    double coordination_loaded; ///< the same over the particles with at least two contacts
    double mean_overlap;        ///< overlap / equivalent radius of the smaller particle, mean
    double max_overlap;         ///< the same, greatest (with walls: of the particle)
    double solid_area;          ///< m2, sum of the particles' areas
} dem2d_packing;

/// Counters.
DEM2D_API dem2d_result dem2d_world_stats(const dem2d_world *world, dem2d_stats *stats);
/// Ids of living particles in the order of their index: up to capacity into ids (may be NULL when
/// capacity is 0); count gets how many there are.
DEM2D_API dem2d_result dem2d_world_particles(const dem2d_world *world, dem2d_particle_id *ids,
                                             int capacity, int *count);
/// Contacts of the last force pass, particle pairs then walls, each in the order of their
/// ids: up to capacity into contacts (may be NULL when capacity is 0); count gets how many.
DEM2D_API dem2d_result dem2d_world_contacts(const dem2d_world *world,
                                            dem2d_contact_info *contacts, int capacity,
                                            int *count);
/// Energies.
DEM2D_API dem2d_result dem2d_world_energy(const dem2d_world *world, dem2d_energy *energy);
/// Love-Weber stress (1/area) sum of f l over the contacts, walls included; area > 0, m2.
DEM2D_API dem2d_result dem2d_world_stress(const dem2d_world *world, double area,
                                          dem2d_stress *stress);
/// Coordination number, overlaps, solid area. Porosity is 1 - solid_area / area of the region.
DEM2D_API dem2d_result dem2d_world_packing(const dem2d_world *world, dem2d_packing *packing);

/* ============================================================================================
   >>api-writers  Pictures
   ============================================================================================ */

/// Takes bytes; returns false when they could not be written.
typedef bool dem2d_write_fn(void *user, const char *bytes, size_t count);

/// An SVG picture of a world.
typedef struct dem2d_svg_desc {
    double width;          ///< px, 0 for 800; the height follows from the scene
    int outline_points;    ///< per curved particle, 0 for 64
    bool force_chains;     ///< lines along branches, width by normal force
    dem2d_write_fn *write; ///< where the bytes go, or NULL when a path is given
    void *user;            ///< handed to write
} dem2d_svg_desc;

/// Draw shapes (a colour per model), walls and force chains to desc->write, or to a file when path
/// is not NULL. Errors: NULL_ARGUMENT, OUT_OF_RANGE, IO, OUT_OF_MEMORY. Does not change the world.
DEM2D_API dem2d_result dem2d_world_write_svg(const dem2d_world *world, const dem2d_svg_desc *desc,
                                             const char *path);

#ifdef __cplusplus
}
#endif

/* Stop here if you only use the library: below is how it works. */

#endif /* DEM2D_H */
