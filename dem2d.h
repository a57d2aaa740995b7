/* dem2d.h - two-dimensional discrete element method for smooth and irregular grains, version 0.7.0

   One C99 header, no dependency but the C standard library. MIT licence (end of file).

   In ONE source file:              Everywhere else:
       #define DEM2D_IMPLEMENTATION     #include "dem2d.h"
       #include "dem2d.h"

   Link with -lm. Recommended: -O2 -fno-math-errno (same numbers, faster square roots).

CONTENTS (search for the anchor, ">>" and the word)

    Manual          what it is, limits, quick start, concepts, how-to,
                    differences from the papers, options, errors, memory,
                    determinism                                             >>manual
    Declarations    version, results, vectors, poses, environment           >>api-types
                    shapes                                                  >>api-shapes
                    mass                                                    >>api-mass
                    outlines of grains                                      >>api-outlines
                    fitting                                                 >>api-fitting
                    contact of two shapes                                   >>api-contact
                    world                                                   >>api-world
                    measures                                                >>api-measures
                    queries of space                                        >>api-queries
                    state hash, snapshots                                   >>api-snapshot
                    writers                                                 >>api-writers
    Implementation  compiler, constants, floating point                     >>config
                    vectors, rotations, sine and cosine                     >>math
                    allocation, log, growing arrays                         >>memory
                    fields of structs and their ranges                      >>fields
                    convex hulls, polygon checks                            >>hull
                    trigonometric polynomials                               >>series
                    support kernels                                         >>support
                    area, centroid, polar moment                            >>mass
                    creation and queries of shapes                          >>shapes
                    outlines from pixels, and their measures                >>outlines
                    templates from outlines, virtual grains                 >>fitting
                    distance: Gilbert-Johnson-Keerthi                       >>gjk
                    depth: expanding polytope                               >>epa
                    two polygons, by edges and corners                      >>edges
                    least support value, certified                          >>minimum
                    faces that meet, two contact points                     >>faces
                    contact of two shapes, of a shape and a wall            >>contact
                    candidate pairs from cell grids                         >>broad
                    spring, friction, critical time step                    >>law
                    leapfrog motion                                         >>motion
                    what a world holds: structs, fields, columns            >>world
                    shapes, materials, particles, by their ids              >>objects
                    walls, their parts and places                           >>walls
                    the neighbour list, particles sorted in space           >>list
                    the ledger of energies                                  >>ledger
                    contacts, sums, motion; the stable time step            >>step
                    energy, stress, fabric, packing, distance from rest     >>measures
                    overlaps, rays, the nearest                             >>queries
                    bytes to a callback or a file                           >>output
                    state hash, snapshots                                   >>snapshot
                    pictures, files for ParaView, histories                 >>writers
    Changes, licence                                                        >>licence

================================================================================================
>>manual

WHAT IT IS
    Grains are convex shapes in the plane: circles, ellipses, polygons (sharp or rounded), closed
    chains of cubic Bezier arcs ("polybeziers"), Fourier series of the support function (FS), or
    your own support function. They push each other with linear springs and Coulomb friction, or by
    your own law, and move by Newton's laws. The methods are those of two papers on irregular
    grains; DIFFERENCES FROM THE PAPERS, below, lists their equations and steps one by one:
      [P] Z. Lai, L. Huang, "A polybezier-based particle model for the DEM modeling of granular
          media", Computers and Geotechnics 134 (2021) 104052, doi 10.1016/j.compgeo.2021.104052
      [F] S. Huang, L. Huang, Z. Lai, "An extension of the Fourier series-based particle model to
          the GJK-based contact detection and resolution framework for DEM", Computational Particle
          Mechanics 9 (2022) 381-391, doi 10.1007/s40571-021-00446-6
    The older model that [F] extends describes the radius, not the support function: Z. Lai,
    Q. Chen, L. Huang, Computer Methods in Applied Mechanics and Engineering 362 (2020) 112873.
    The stateless layer (shapes, mass, fitting, contact of two shapes) works without a world.

WHAT IT DOES NOT DO
    3D; concave grains (a later version joins convex parts); bonded or breaking grains; fluids;
    heat. It has no threads, windows, random numbers, clocks or formats for grains of its own.

LIMITS
    * Doubles only. At most 2^30 particles, and as many listed contacts. Sizes and coordinates are
      best within 1e-60 to 1e60.
    * The rotation of a step has an error of angle^5/120: a particle should not turn by more than
      0.01 in a step.
    * A particle that moves or turns by more than its inscribed radius in a step may pass through
      others. dem2d_stats.fast_motion counts the checks that found such a particle (first step,
      after edits, every 160th step); the log gets the first one.
    * A custom support function that is not convex can't be detected; contacts are then wrong.
    * Where two faces meet, two points carry the contact, and their forces follow from an energy.
      The moment jumps when the deeper point changes sides, in two cases: the common part is shorter
      than an eighth of the shorter face, or the overlap is above half the length of that face times
      the angle to the next face (for a regular 64-gon: 0.5 % of its radius). At sharp corners the
      normal jumps too: time steps are of first order there. Energy is not exactly conserved when
      an edge slides past the free end of a segment wall.
    * Where the support value hardly changes with the direction (bodies of constant width, one
      concentric with the other), a search may reach its limit of iterations. The state is then
      DEM2D_UNRESOLVED, and the bounds are a few 1e-4 of the size apart.
    * 32-bit x86 needs SSE2 (-msse2 -mfpmath=sse): x87 results depend on which values stay in
      registers.
    * -ffast-math and its parts change results: -ffinite-math-only, -fassociative-math,
      -freciprocal-math, -funsafe-math-optimizations. The header does not compile with them where
      the compiler defines a macro for them: gcc does for all, clang for -ffast-math and
      -ffinite-math-only.

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
        scene.local_damping = 0.3; // brakes free fall too: to 0.7 g
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
    Angles      Radians, counter-clockwise. Outlines run counter-clockwise; clockwise input is
                reversed.
    Support     For a unit direction u the support point s(u) is the point of the shape farthest
                along u, h(u) = s.u the support value, rho(u) the radius of curvature there (0 at
                a corner). If u is normal to an edge, s(u) is one end of that edge.
    Template    A shape is created once, recentred on its centroid, and used at many poses. A
                pose is the position of the centroid, a rotation, and a scale factor.
    Contact     The normal points from A to B. depth = min over u of h_A(u) + h_B(-u) - d.u with
                d the vector from A's centre to B's; positive is overlap, negative a gap. The
                true depth differs from it by `error` at most. This bound is proved:
    Proof       Certified contacts find a minimum of h by Newton's steps on the osculating circle,
                then prove that no other minimum is lower. BY_RADIUS: where the depth is below the
                least radius of curvature r, h - r is the support value of a convex body, so a
                stationary value below r is the least of all; and a direction with h < 0 proves a
                gap. BY_ARC: tables of least radii of curvature show that h stays above the minimum
                in all directions that the inscribed circles leave open (a cone about d). BY_FORM:
                closed form for circles, and for edges and corners of two polygons. BY_POLYTOPE:
                branch and bound over arcs of directions, for all other cases.
    Face        Where two edges meet (polygons, straight arcs, walls) two points carry the contact:
                the ends of the common part. Each has its own depth and the full stiffness kn; the
                second has less where the common part is short. Their forces are the gradient of an
                energy and grow from zero, so that energy is conserved and piles come to rest.
    Wall        A half-plane: its normal points into the grains. Or a segment, which has two sides.
                Segments may form a chain: a particle at a joint of two segments has one contact.
                A wall stands still, moves at a velocity, or is servo-controlled to a stress.
    Name        Of the two of a pair, A is the one with the lower id, and sums over contacts and
                particles go by ids, walls last. dem2d_particle_desc.name and dem2d_wall_desc.name
                (64 bits, 0: none) replace this order: first by name, then by id. With the same
                names, worlds that were built in another order, or that hold a part of a scene
                each, get the same bits. Names need not be unique; they take 16 bytes a particle
                in worlds that have some, and nothing in others. dem2d_world_particles keeps the
                order of ids.
    Immovable   Two particles that are fixed or driven have no contact with each other, nor with a
                wall without servo control: they may overlap, and have no force, energy or stress.
    Force       On B, along the normal at each contact point: kn times depth, and a dashpot if the
                materials have one; never attractive. Along the tangent an incremental spring kt,
                limited to friction times the normal force ([F] eq. 8-10). A rolling spring resists
                relative rotation if the materials have rolling friction. A law of your own can
                replace all of these.
    Sliding     For all pairs, the tangential spring stretches by the sliding velocity of the last
                step times the time step. The sliding velocity is the mean of its values with the
                normal and arms at the beginning and at the end of the step, both with the
                velocities of that step. In the first step of a contact only the end is used. A time
                step or velocity that you change during a contact takes effect with the next move.
    Skipping    A pair with a known gap is not collided again until its particles have moved and
                turned by that gap together. Circle pairs skip this test: it costs more than the
                contact itself.
    List        The neighbour list (Verlet list) holds the pairs that are nearer than the sum of
                their skins. It is rebuilt when a particle has moved as far as its skin. Skins are
                tuned to the motion: thick skins list more pairs that are apart, thin ones cause
                more rebuilds. A fast particle gets a thicker skin. Edits keep the list, except: a
                particle or a wall is added, removed or moved out of its skin; a particle becomes
                fixed or free; friction, a dashpot or rolling friction is set where no materials had
                it, or removed from the last ones.
    Step        Positions are at step n, velocities half a step earlier (leapfrog). Contacts,
                forces, energies and stresses are those of the last force evaluation ("force pass"):
                at the positions before the last move. Kinetic energy is the mean of the two half
                steps around it.
    Ledger      A force acts from half a step before its evaluation to half a step after, and the
                ledger counts its work over that time; the work of each dashpot at its own contact
                point, until the contact opens. The closure is stored and dissipated energy less
                what was put in. Compare it with the turnover, the energy that has gone from one
                account to another: half the sum of the absolute changes of all accounts in each
                step.
    Damping     local (Cundall): each force component reduced by alpha |F| sign(v).
                global viscous: v <- ((1 - xi dt/2) v + dt F/m) / (1 + xi dt/2).
    Stress      Compression positive, strains too.
    Measures    Queries and writers describe the last force evaluation. They never change the
                simulation: results have the same bits with and without them.

HOW TO
    make a shape         dem2d_shape_create_*, or dem2d_shape_create_custom with a support function
                         of yours. Give it to a world with dem2d_world_add_shape: the world keeps a
                         copy, so destroy yours at any time.
    inspect a shape      dem2d_shape_get (size, radii of curvature), dem2d_shape_mass,
                         dem2d_shape_axis (long axis); at a pose: dem2d_shape_aabb (bounding box),
                         dem2d_shape_contains, dem2d_shape_support, dem2d_shape_outline.
    place a shape        dem2d_pose_make, dem2d_rot_make; back to an angle: dem2d_rot_angle.
    fit a grain          dem2d_outline_fit: any model, by count or by coverage, with a report.
                         The papers' steps one by one: dem2d_fourier_fit, dem2d_fourier_reduce,
                         dem2d_bezier_fit.
    fit a photo          dem2d_image_outlines, then for each i below dem2d_outline_set_count:
                         dem2d_outline_set_get and dem2d_outline_fit; dem2d_outline_set_destroy.
                         Label masks of other programs: labels. Frames and scale bars: crop_*,
                         ignore_frame. The threshold alone: dem2d_image_threshold.
    draw one at random   dem2d_fourier_virtual, then dem2d_shape_create_fourier.
    measure a grain      dem2d_outline_measure; its hull: dem2d_polygon_hull, its mass:
                         dem2d_polygon_mass; two outlines: dem2d_outline_compare.
    test two shapes      dem2d_pair_overlap (yes or no), dem2d_pair_distance (gap, witness
                         points), dem2d_pair_contact (gap or depth, normal, contact point);
                         a shape and a half-plane: dem2d_wall_contact. Pass the last normal as
                         desc.start when the pair has moved little, and skip_points if the contact
                         points are not needed.
    use a world of yours dem2d_pairs_contact: many pairs of bodies in one call, each with a memory
                         that you keep from step to step, so that most pairs take one evaluation.
    repeat the papers    dem2d_world_desc.solver = DEM2D_GJK_EPA, faces = DEM2D_ONE_POINT; templates
                         by DEM2D_FIT_REDUCTION and DEM2D_FIT_SWARM, unbounded; local_damping = 0.7
                         ([P]) or global_damping = 0.7 ([F]). Example: examples/biaxial.c --papers.
    choose a time step   dem2d_world_time_step_bounds on a settled scene. The world checks its time
                         step in the first step, after edits that can matter, and in every 160th.
    lose energy          damping_ratio of the materials, from dem2d_damping_ratio(restitution);
                         rolling_friction for grains that should not roll; else friction, damping.
    push grains          dem2d_world_set_load: a force and a torque until you set others. What
                         changes from step to step (drag, magnets, motors) is set by
                         dem2d_world_desc.loads. The work is in the ledger.
    share a scene        Each world holds its own grains, and copies (ghosts) of the others' grains
      out to processes   within reach, with the same names. dem2d_world_desc.gather gives each ghost
                         the force that its owner has found: the worlds then move like one, to the
                         bit. commit lets them agree whether a step is made (tests/test_exchange.c).
    use a law of yours   dem2d_world_desc.law: it gets the depth, the velocities at the contact and
                         the state it stored in the step before.
    change how two       dem2d_world_set_pair: stiffnesses, friction, damping ratio and rolling
      materials meet     friction of a pair. With friction 0, for example, a wall is smooth.
    change a world       Between steps: dem2d_world_set_gravity, dem2d_world_set_damping,
                         dem2d_world_set_time_step, dem2d_world_set_wall (where, how fast, stress);
                         dem2d_world_drive_particle (velocity, motion), dem2d_world_move_particle.
    remove from a world  dem2d_world_remove_particle, dem2d_world_remove_wall,
                         dem2d_world_remove_shape.
    read a world         dem2d_world_particles for the ids, dem2d_world_get_particle for the state
                         of one, dem2d_world_shape for its template; dem2d_world_get_wall;
                         dem2d_world_contacts for contact points and forces; dem2d_world_stats for
                         counters and time.
    ask what is where    dem2d_world_query_box, dem2d_world_query_point, dem2d_world_query_shape for
                         what overlaps; dem2d_world_cast_ray for the first hit of a ray,
                         dem2d_world_cast_ray_all for all; dem2d_world_nearest. Also before the
                         first step. dem2d_world_particle_contacts: contacts of one particle.
    build a hopper       walls with segment: where two meet, a particle has one contact.
    follow the energy    dem2d_world_energy for what is stored. dem2d_world_desc.ledger, then
                         dem2d_world_ledger: what gravity, walls and you put in, where it went, and
                         the error of the sum.
    hold a stress        a wall with mode DEM2D_WALL_SERVO, stress, max_speed (no default: how fast
                         it may follow), and a length: constant or the distance between two other
                         walls. Its normal points to the grains it presses on; so does a
                         segment's, which grains may touch from both sides.
    stop and go on       dem2d_world_save, dem2d_world_load: the run continues to the same bits.
    compare two runs     dem2d_world_hash after as many steps.
    draw                 dem2d_world_write_svg, or dem2d_shape_outline for your own pictures.
    measure a sample     dem2d_world_stress with the sample's area (of one grain:
                         dem2d_world_particle_stress), then dem2d_stress_principal for p and q;
                         dem2d_strain of its sides; dem2d_world_porosity of a box inside it;
                         dem2d_world_packing: coordination number, overlaps, rattlers.
    tell it is at rest   dem2d_world_equilibrium: unbalanced below 1e-3, a small kinetic_ratio.
    load it slowly       dem2d_world_inertial_number below 1e-3.
    explain its strength dem2d_world_fabric: anisotropies of contacts and forces, and the q/p that
                         they predict; dem2d_world_histogram for polar diagrams.
    look in ParaView     dem2d_world_write_vtp, a file for each part and time; dem2d_pvd_write
                         makes a series of them. Colour grains by any of their arrays.
    keep a history       dem2d_world_write_csv after every so many steps, with append from the
                         second row on.
    keep it private      define DEM2D_STATIC beside DEM2D_IMPLEMENTATION: all functions are static,
                         and the compiler drops those you do not call. One pair query takes about a
                         second to compile and 50 kB (gcc 12, -O2).
    check the version    dem2d_version() == DEM2D_VERSION: header and implementation agree.

DIFFERENCES FROM THE PAPERS (same: as printed; corrected: the printed form has an error; improved:
the default does better, and the paper's method is available where it is named; chosen: the paper
leaves it open)
    [P] fig. 1, eq. 1-2: cubic arcs with common tangents   dem2d_shape_create_bezier
        same. Neighbours have to share a tangent, each arc has to be convex.
    [P] eq. 3-8: support point and its parameter           dem2d_shape_support
        same, in Bernstein form.
    [P] eq. 9: the parameter's closed form                 dem2d_shape_support
        corrected: the discriminant is 4 M3^2 - 12 M4 M2, printed with M2^2; the formula divides by
        M4, which is 0 for straight arcs and arcs of lower degree. Here the root is taken with like
        signs in its denominator: no such case, no cancellation.
    [P] eq. 10-11: mass, moment of inertia                 dem2d_shape_mass_interpolated
        corrected: eq. 11 is about the origin; about the centroid m |c|^2 has to be taken off.
        Improved: dem2d_shape_mass is exact for every model.
    [P] sec. 3: broad phase by bounding volumes            dem2d_world_step
        chosen: bounding circles on a grid; a list of the pairs within a skin.
    [P] eq. 12, sec. 3.1 steps 1-7, fig. 2-3: GJK          dem2d_pair_overlap, dem2d_pair_distance
        same. Chosen: the first direction is the line of centres, or the caller's.
    [P] eq. 13, sec. 3.2, fig. 5: depth by EPA             dem2d_pair_contact, DEM2D_GJK_EPA
        corrected: v has to be a unit vector. Corrected: the printed residual, |W| less the least
        distance of an edge, is reported (dem2d_contact.residual), but does not stop EPA: it does
        not vanish where the minimum is on an edge of two polygons. W.v less that distance does.
        Chosen: tolerances are relative to the sizes. Improved: DEM2D_CERTIFIED finds the least
        depth by Newton's steps and proves it, in two to four support calls.
    [P] sec. 3.2, fig. 4a, 4b: contact point               DEM2D_ONE_POINT
        same: the middle of both witness points; at a wall, of support point and foot point.
        Improved: DEM2D_TWO_POINTS where faces meet, because the middle of two parallel faces jumps
        with the last bit of the angle and does not conserve energy. At a wall DEM2D_TWO_POINTS
        takes the foot point: the wall is rigid, so that the grain has all of the deformation.
    [P] sec. 4 steps 1-5: templates by particle swarm      DEM2D_FIT_SWARM
        same steps, when unbounded. Chosen: birds, moves, constriction, pixels; knots that share
        a corner of the hull are moved away from it. Improved: a bound of the radius of curvature,
        with straight arcs; dem2d_bezier_fit and DEM2D_FIT_AREA minimise the exact area of the
        symmetric difference.
    [P] sec. 5.1: accuracy score; [F] sec. 3.1: percent coverage     dem2d_outline_compare
        same (coverage, a fraction), by exact areas instead of pixels.
    [P] sec. 5.2: equivalent size                          dem2d_shape_info.equivalent
        half of it: the radius, not the diameter, of the circle of equal area.
    [P] fig. 11, [F] fig. 6: relative kinetic energy       dem2d_equilibrium.kinetic_ratio
        same. Alignment, [P] fig. 12: DEM2D_HISTOGRAM_ORIENTATION, of the axis of greatest inertia.
    [P] sec. 5.3: p, q, strains                            dem2d_stress_principal, dem2d_strain
        corrected: p and q are printed without the halves (q/p is the same), eps_a and eps_v are
        exchanged, and compression is positive only with a minus before the logarithms.
    [P] sec. 5.3: anisotropy of normals, forces, contact branch orientation  dem2d_world_fabric
        same, and DEM2D_HISTOGRAM_NORMAL, _ALONG_BRANCH, _NORMAL_FORCE, _TANGENTIAL_FORCE.
    [P] sec. 5.3: servo control                            DEM2D_WALL_SERVO
        chosen: see dem2d_wall_desc.
    [P] damping 0.7                                        dem2d_world_desc.local_damping
        same (PFC's, Cundall's).
    [F] damping 0.7, velocity based                        dem2d_world_desc.global_damping
        same, 1/s (Andrade and others 2012).
    [F] eq. 1-4: support function, support point           dem2d_shape_create_fourier
        same. Improved: the centroid is the origin; a1 = b1 = 0 puts the Steiner point there.
    [F] eq. 5: p'' + p >= 0                                dem2d_fourier_convexity
        same, by a rigorous bound of the least value.
    [F] eq. 6: phases                                      not needed
        corrected: with beta = atan2(b, a) it is cos(n t - beta), printed sin(n t + beta).
    [F] eq. 7: sufficient condition                        DEM2D_SUFFICIENT
        same. Improved: DEM2D_EXACT; the condition is far too strict.
    [F] sec. 2.3: fit by least squares, reduction          dem2d_fourier_fit, dem2d_fourier_reduce
        corrected: the tolerance 1e-6 is a length; here it is relative to a0. Chosen: the factor
        0.9. Improved: DEM2D_FIT_CONSTRAINED, the constrained minimum that [F] leaves to the future.
    [F] sec. 3.1: the radius as a Fourier series           dem2d_radial_compare
        for comparison only: it is no shape here.
    [F] eq. 8-10: contact law                              dem2d_material_desc
        corrected: eq. 9 caps one sign; here -mu F_n <= F_t <= mu F_n. Chosen: the step's sliding
        velocity, see Sliding. Beyond: dashpots, rolling friction (eq. 10: none), your own law.

OPTIONS
    The comments in the desc structs give the unit, the range and the meaning of 0 for each field:
    0 is a physical 0, the first value of an enum, or stands for what the comment names ("0 for
    128"). A field whose range leaves out 0 is required. Numbers and vectors have to be finite.
    Where a desc may be NULL, NULL means that all its fields are 0.

ERRORS
    Functions that can fail return a dem2d_result; dem2d_result_text gives its text. Outputs are
    written only on success, and a failing call leaves everything as it was. The log callback of
    the environment gets the details: which field, which value, which index. It also gets warnings
    (DEM2D_WARNING) of calls that succeed. A step that fails (non-finite state, no memory, time
    step too long) leaves the world as it was before that step.
    Contact queries return a state and never a guess: DEM2D_UNRESOLVED comes with the bounds that
    were reached.

THREADS
    No globals. Different threads may use different worlds and shapes at once; of one world only one
    call at a time, queries included. A world starts no threads, but passes all work that takes time
    to desc.parallel_for, if there is one, in blocks of some hundred contacts or particles: any
    thread system will do (examples/threads_posix.c, threads_openmp.c). A block writes only its own
    results, and sums are taken in the order of names and ids. So neither the number of threads nor
the distribution of the blocks can change a bit. One thread does the short loops over all particles
    when the list is rebuilt, the sums of the forces on walls, and the speeds of servo walls. All
    threads call custom support functions and laws (the calling thread also calls a law for the
    speed of a servo wall); only the thread that called the step allocates and writes to the log.

COSTS (instructions per circle and step of a settled bed with 2.0 contacts each, gcc -O2, by
`make -C tests bench-cost`; a feature that the scene does not use costs nothing: which features are
in use is decided after an edit)
    circles, no friction, no damping                     307    53 without a contact
    the list rebuilt once in 100 steps                   +30
    friction and its history                            +157
    spinning without friction                            +24
    local damping                                        +10
    global damping                                       +26
    gravity                                               +3
    fixed particles, walls, segments, parallel_for        +1    present, but nothing touches them
    polygons for a tenth of the circles                 +521
    energy and stress queried in every step            +1810
    the ledger of energies                             +1791
    a dashpot, rolling friction, a law of your own     +1239    circles then take the general path
    a pair of circles listed but apart                    75    same as in contact: no branch
    another pair listed but apart, known gap              70    colliding it costs 700 to 2000
    a region without particles, a pair of fixed ones       0

MEMORY
    All memory comes through dem2d_env (malloc and free by default); release gets the size. A step
    allocates nothing once the neighbour list has stopped growing; dem2d_world_stats gives the bytes
    in use. Capacities reserve memory at creation. A circle takes about 400 bytes with its contacts
    if particle_capacity is given, else up to a half more; another shape 300 bytes more for each
    listed pair. Particles are now and then sorted in memory by their place in space; this changes
    no id, no order and no result.

SNAPSHOTS
    dem2d_world_save writes all that later steps and queries depend on, with the neighbour list and
    the order in memory; dem2d_world_load continues to the same bits, on any machine and with any
    number of threads. Not saved: capacities, the environment, parallel_for. The tags of custom
    shapes identify their support functions. A snapshot names its arrays and their fields: a later
    header reads it and sets its additional fields to 0. An unknown name means that a later header
    wrote the file: it is refused, and the log gets the name. A checksum detects damage before the
    bytes are used, and every number is checked for its range; this does not protect from forgery.

DETERMINISM
    Same input, same bits: on gcc and clang, C and C++, -O0 to -O3, with or without FMA hardware
    (contraction is off inside this header). Steps use only + - * / and sqrt; sine, cosine and
    arctangent are the header's own. A pair is (lower id, higher id) and forces are summed in the
    order of the partner's id, so neither addresses nor storage order can change a bit. With names
    of your own (see Name in CONCEPTS) the bits do not depend on ids, either. Not
    covered: clang -ffp-contract=fast on the command line, and 80-bit x87 arithmetic. Compare two
    runs by dem2d_world_hash.
    Your own arithmetic (positions and velocities you compute, support functions, contact laws) is
    compiled with your flags: give -ffp-contract=off if its bits have to be the same as well. The
    implementation ends by setting clang's contraction to the mode of the command line: put a
    contraction pragma of yours after it.
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
#define DEM2D_VERSION_MINOR 7
#define DEM2D_VERSION_PATCH 0
#define DEM2D_VERSION \
    (DEM2D_VERSION_MAJOR * 10000 + DEM2D_VERSION_MINOR * 100 + DEM2D_VERSION_PATCH)
#define DEM2DI_JOIN(major, minor, patch) #major "." #minor "." #patch
#define DEM2DI_JOIN_VALUES(major, minor, patch) DEM2DI_JOIN(major, minor, patch)
#define DEM2D_VERSION_STRING \
    DEM2DI_JOIN_VALUES(DEM2D_VERSION_MAJOR, DEM2D_VERSION_MINOR, DEM2D_VERSION_PATCH)

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
#define DEM2D_RESULTS(X)                                                   \
    X(OK, "no error")                                                      \
    X(NULL_ARGUMENT, "a required pointer is NULL")                         \
    X(NOT_FINITE, "a number is not finite")                                \
    X(OUT_OF_RANGE, "a number is outside its range")                       \
    X(OUT_OF_MEMORY, "the allocator returned NULL")                        \
    X(TOO_FEW_POINTS, "too few points")                                    \
    X(DUPLICATE_POINT, "two neighbouring points coincide")                 \
    X(NOT_CONVEX, "the outline is not convex")                             \
    X(ZERO_AREA, "the area is zero")                                       \
    X(NOT_SMOOTH, "two arcs do not share their tangent")                   \
    X(NEGATIVE_CURVATURE, "the radius of curvature is negative somewhere") \
    X(STALE_ID, "no object of this world has this id")                     \
    X(IN_USE, "another object uses this object")                           \
    X(TIME_STEP, "the time step is above the stable limit")                \
    X(STATE, "the state after the step would not be finite")               \
    X(NOT_REACHED, "the coverage asked for was not reached")               \
    X(IO, "reading or writing failed")                                     \
    X(FORMAT, "not a snapshot, or damaged")                                \
    X(FORMAT_VERSION, "a snapshot of another version")                     \
    X(CROSSING, "the outline crosses itself")                              \
    X(WARNING, "a warning: the call goes on")

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

/// Rotation as cosine and sine; {1, 0} is no rotation.
typedef struct dem2d_rot {
    double c; ///< cosine
    double s; ///< sine
} dem2d_rot;

/// Where a shape is: its point x goes to position + scale * (rotation applied to x).
typedef struct dem2d_pose {
    dem2d_vec position; ///< of the centroid, m
    dem2d_rot rotation; ///< cosine and sine; normalised where a pose is taken
    double scale;       ///< size factor, > 0
} dem2d_pose;

/// Memory and messages. Where a function takes an environment, NULL means malloc, free and no log.
typedef struct dem2d_env {
    void *user;                                 ///< passed to the callbacks
    void *(*allocate)(void *user, size_t size); ///< like malloc; used only if release is set too
    /// Like free, with the size that was asked for. If one of the two is NULL: malloc and free.
    void (*release)(void *user, void *memory, size_t size);
    /// Gets the details of an error, or of a warning (DEM2D_WARNING, which no function returns);
    /// index is the offending point, arc or object, or -1.
    void (*log)(void *user, dem2d_result result, int index, const char *text);
} dem2d_env;

/// Version of the implementation: DEM2D_VERSION when header and implementation agree.
DEM2D_API int dem2d_version(void);
/// One-line text of a result; never NULL.
DEM2D_API const char *dem2d_result_text(dem2d_result result);
/// Rotation by an angle in radians; the same bits on every platform. NaN when |angle| > 2^30.
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

/// Models of a shape.
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

/// Support function of a custom shape: returns the point farthest along the unit direction (m), in
/// the shape's own coordinates. If rho is not NULL, it stores the radius of curvature there (m).
typedef dem2d_vec dem2d_support_fn(void *user, dem2d_vec direction, double *rho);

/// Custom shape.
typedef struct dem2d_custom_desc {
    dem2d_support_fn *support; ///< convex support function; required
    void *user;                ///< passed to support
    double rho_min;            ///< m, >= 0, lower bound of the radius of curvature; 0 if unknown
    double inscribed;          ///< m, >= 0, radius of a circle inside about the centroid; or 0
    dem2d_mass mass;           ///< m2, m, m4, >= 0; from points of the outline if area is 0
    int outline_points;        ///< number of these points, >= 3; 0 for 1000
    int tag;                   ///< identifies support in snapshots: see dem2d_load_desc
} dem2d_custom_desc;

/// What a shape is, as a template (scale 1, about its centroid).
typedef struct dem2d_shape_info {
    dem2d_shape_type type; ///< which model
    int count;             ///< number of vertices or arcs, or order of the series; else 0
    double rounding;       ///< m, rounding radius of a polygon
    dem2d_mass mass;       ///< exact; the centroid is 0
    dem2d_vec offset;      ///< m, centroid of the data given at creation
    double circumscribed;  ///< m, radius of the bounding circle about the centroid
    double inscribed;      ///< m, radius of the inscribed circle about the centroid
    double rho_min;        ///< m, lower bound of the radius of curvature; 0 with corners
    double rho_max;        ///< m, upper bound of it without edges and straight arcs; HUGE_VAL if an
                           ///< arc is flat at a point; custom: 0
    double deviation;      ///< m, polybezier: distance of the contact arcs from the given ones
    double equivalent; ///< m, radius of the circle of equal area ([P] equivalent size: twice it)
    size_t bytes;      ///< memory of the template
} dem2d_shape_info;

/// Axis-aligned box.
typedef struct dem2d_box {
    dem2d_vec lower; ///< least x and y
    dem2d_vec upper; ///< greatest x and y
} dem2d_box;

/// Answer to a support query.
typedef struct dem2d_support {
    dem2d_vec point;     ///< m, farthest point
    dem2d_vec direction; ///< the direction asked for, normalised
    double value;        ///< m, point . direction, relative to the pose's position
    double rho;          ///< m, radius of curvature at the point; 0 at a corner
} dem2d_support;

/// Circle with a radius > 0 (m). *shape is the caller's, to be released by dem2d_shape_destroy; so
/// for all shapes. Errors of all: NULL_ARGUMENT, OUT_OF_MEMORY, OUT_OF_RANGE (also sizes whose
/// area or polar moment is not a normal number). Also: NOT_FINITE, ZERO_AREA (radius 0).
DEM2D_API dem2d_result dem2d_shape_create_circle(const dem2d_env *env, double radius,
                                                 dem2d_shape **shape);
/// Ellipse with half axes a along x and b along y, both > 0 (m). Errors as for a circle.
DEM2D_API dem2d_result dem2d_shape_create_ellipse(const dem2d_env *env, double a, double b,
                                                  dem2d_shape **shape);
/// Convex polygon of count >= 3 points (m), grown by a rounding radius >= 0 (m). Clockwise input is
/// reversed, points on an edge (within rounding errors) are dropped. Errors: NOT_FINITE,
/// TOO_FEW_POINTS, DUPLICATE_POINT, NOT_CONVEX, ZERO_AREA, OUT_OF_RANGE (negative rounding).
DEM2D_API dem2d_result dem2d_shape_create_polygon(const dem2d_env *env, const dem2d_vec *points,
                                                  int count, double rounding, dem2d_shape **shape);
/// Closed chain of cubic Bezier arcs ([P] sec. 2): control[3 * arcs] (m), arc i uses the points
/// 3i .. 3i + 3 (cyclic), of which the first and the last are knots, where two arcs meet;
/// 2 <= arcs <= INT_MAX / 12. Each arc has to be convex and to turn by at most pi, neighbours share
/// a tangent (G1), and all arcs together make one turn; a sine of 1e-6 is allowed, the precision of
/// coordinates with seven digits. M3 = M4 = 0 is allowed. Arcs shorter than 6e-14 of the size count
/// as corners and may turn in any way. Clockwise input is reversed.
///
/// Contacts use repaired arcs: exactly convex and smooth, and straight where the given arc is
/// straight within the rounding of its coordinates. Their distance from the given arcs is the
/// `deviation` of dem2d_shape_info; the error of every contact includes it. Mass, outline, bounding
/// box, dem2d_shape_support and dem2d_wall_contact use the given arcs. Errors: NOT_FINITE,
/// TOO_FEW_POINTS, OUT_OF_RANGE (too many arcs), NOT_CONVEX, NOT_SMOOTH, DUPLICATE_POINT (all
/// control points of an arc coincide), ZERO_AREA.
DEM2D_API dem2d_result dem2d_shape_create_bezier(const dem2d_env *env, const dem2d_vec *control,
                                                 int arcs, dem2d_shape **shape);
/// Support function p(t) = a[0]/2 + sum over n = 1..order of a[n] cos nt + b[n] sin nt ([F]
/// sec. 2); a and b (m) have order + 1 elements, b[0] is not read; order 0 to 2^20. The radius of
/// curvature p + p'' must nowhere be negative. Errors: NOT_FINITE, OUT_OF_RANGE (order), ZERO_AREA
/// (a[0] not above 0), NEGATIVE_CURVATURE.
DEM2D_API dem2d_result dem2d_shape_create_fourier(const dem2d_env *env, const double *a,
                                                  const double *b, int order, dem2d_shape **shape);
/// The caller's support function. The bounding circle follows from four calls of it; the mass, if
/// it is not given, from the polygon through outline points. Errors: NOT_FINITE, OUT_OF_RANGE,
/// ZERO_AREA.
DEM2D_API dem2d_result dem2d_shape_create_custom(const dem2d_env *env,
                                                 const dem2d_custom_desc *desc,
                                                 dem2d_shape **shape);
/// Release a shape; NULL is allowed.
DEM2D_API void dem2d_shape_destroy(dem2d_shape *shape);
/// Model, mass and sizes of a template. Errors: NULL_ARGUMENT.
DEM2D_API dem2d_result dem2d_shape_get(const dem2d_shape *shape, dem2d_shape_info *info);
/// Support point in a finite direction of any length but 0. Errors: NULL_ARGUMENT, NOT_FINITE,
/// OUT_OF_RANGE (zero direction, zero rotation, scale not above 0).
DEM2D_API dem2d_result dem2d_shape_support(const dem2d_shape *shape, dem2d_pose pose,
                                           dem2d_vec direction, dem2d_support *support);
/// Axis-aligned bounding box at a pose (m), exact: four support values. Errors: NULL_ARGUMENT,
/// NOT_FINITE, OUT_OF_RANGE (pose).
DEM2D_API dem2d_result dem2d_shape_aabb(const dem2d_shape *shape, dem2d_pose pose, dem2d_box *box);
/// count >= 3 points on the boundary (m), counter-clockwise. Smooth shapes: uniform directions;
/// polybeziers: uniform parameter; polygons: the corners, further points divide the edges equally
/// (of rounded polygons the circular arcs). Errors: NULL_ARGUMENT, TOO_FEW_POINTS, NOT_FINITE,
/// OUT_OF_RANGE (pose).
DEM2D_API dem2d_result dem2d_shape_outline(const dem2d_shape *shape, dem2d_pose pose, int count,
                                           dem2d_vec *points);
/// Direction of the long axis of a template (rad, in (-pi/2, pi/2], from x) and the ratio >= 1 of
/// its greater to its smaller radius of gyration; 0 and 1 if it has no long axis (circles, regular
/// polygons). Exact up to rounding errors, for custom shapes to 1e-4. (The ratio of a needle that
/// is not parallel to x or y has a relative error of 1e-15 times the ratio.) Errors: NULL_ARGUMENT.
DEM2D_API dem2d_result dem2d_shape_axis(const dem2d_shape *shape, double *angle, double *ratio);

/* ============================================================================================
   >>api-mass  Area, centroid, polar moment
   ============================================================================================ */

/// Mass of a simple polygon of count >= 3 points (m), either orientation, about its centroid ([P]
/// eq. 10-11 with the missing - m |c|^2). Errors: NULL_ARGUMENT, TOO_FEW_POINTS, NOT_FINITE,
/// ZERO_AREA.
DEM2D_API dem2d_result dem2d_polygon_mass(const dem2d_vec *points, int count, dem2d_mass *mass);
/// Mass of a template, exact up to rounding errors (custom shapes: as created). Errors:
/// NULL_ARGUMENT.
DEM2D_API dem2d_result dem2d_shape_mass(const dem2d_shape *shape, dem2d_mass *mass);
/// Mass of a template from the polygon through count >= 3 outline points ([P] eq. 10-11): the error
/// falls as 1/count^2. Allocates nothing. Errors: NULL_ARGUMENT, TOO_FEW_POINTS.
DEM2D_API dem2d_result dem2d_shape_mass_interpolated(const dem2d_shape *shape, int count,
                                                     dem2d_mass *mass);

/* ============================================================================================
   >>api-outlines  Outlines of grains: from pixels, and their measures
   ============================================================================================ */

/// A picture of grains with one or two bytes per pixel, row 0 on top. Grains are darker (or
/// brighter) than a threshold, or have a label.
typedef struct dem2d_image_desc {
    const uint8_t *pixels;    ///< height rows of width values; either this
    const uint16_t *pixels16; ///< or this, with two bytes each, is required, not both
    int width;                ///< px, 1 to 2^15
    int height;               ///< px, 1 to 2^15
    int stride;               ///< px from row to row, >= 0, not below width; 0 for width
    int crop_left;            ///< px, >= 0, columns left of the region of interest
    int crop_top;             ///< px, >= 0, rows above it
    int crop_width;           ///< px, >= 0, width of the region; 0 for all right of crop_left
    int crop_height;          ///< px, >= 0, height of the region; 0 for all below crop_top
    bool labels;              ///< values are grain numbers, 0 is background (a label mask); the
                              ///< next three are then 0
    int threshold;            ///< grains are darker than this, 0 to 65535 (pixels: to 255); 0
                              ///< finds it (Otsu)
    bool ignore_frame;        ///< find the threshold without a frame along the region's border
    bool bright;              ///< grains have values from the threshold on instead
    int min_pixels;           ///< >= 0, smaller grains are dropped; 0 for 16
    int max_pixels;           ///< >= 0, larger grains are dropped; 0 for no limit
    bool keep_border;         ///< keep grains that touch the region's border
    double scale;             ///< m/px, > 0
} dem2d_image_desc;

/// One outline of a set; valid until the set is destroyed.
typedef struct dem2d_outline {
    const dem2d_vec *points; ///< m, simple, counter-clockwise; y up
    int count;               ///< number of points
    int pixels;              ///< number of pixels of the grain, holes filled
    int row;                 ///< row of its topmost pixel
    int column;              ///< column of the leftmost pixel in that row
} dem2d_outline;

/// Outlines found in a picture, sorted by row, then column. Opaque.
typedef struct dem2d_outline_set dem2d_outline_set;

/// Measures of an outline.
typedef struct dem2d_outline_info {
    dem2d_mass mass;            ///< area, centroid, polar moment
    double perimeter;           ///< m
    double feret_max;           ///< m, length: the greatest distance of two points
    double feret_min;           ///< m, width: the least distance of two parallel tangents
    double aspect;              ///< feret_max / feret_min
    double sphericity;          ///< width-to-length, feret_min / feret_max
    double circularity;         ///< 4 pi area / perimeter^2
    double solidity;            ///< area / area of the hull
    double roundness;           ///< Wadell: mean radius of corners / inscribed radius
    double inscribed;           ///< m, radius of the largest inscribed circle
    dem2d_vec inscribed_at;     ///< m, its centre
    double circumscribed;       ///< m, radius of the smallest enclosing circle
    dem2d_vec circumscribed_at; ///< m, its centre
} dem2d_outline_info;

/// How two outlines differ.
typedef struct dem2d_difference {
    double coverage;  ///< 1 - area / area of the reference ([F] percent coverage, [P] accuracy
                      ///< score, as a fraction); negative if they hardly overlap
    double area;      ///< m2, of the symmetric difference
    double hausdorff; ///< m, greatest distance of a corner of one from the other's boundary
} dem2d_difference;

/// Otsu's threshold of a picture's region: grains (or the background) have values below it; 0 for a
/// region of one value. ignore_frame leaves out a frame: the values are divided into three classes
/// (Otsu), the class of most border pixels is the frame's, and pixels of this class that are
/// connected with the border do not count. Errors: NULL_ARGUMENT, OUT_OF_RANGE (also labels),
/// OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_image_threshold(const dem2d_image_desc *desc, int *threshold);
/// Outlines of the grains in a picture: threshold, 4-connected components, holes filled, boundary
/// by linear interpolation between pixel centres. The centre of the pixel in row r, column c is at
/// ((c + 0.5) scale, (height - r - 0.5) scale), with or without a crop. The set may be empty, for
/// example if the picture has one value only.
///
/// All that lies in a hole of a grain belongs to the grain. A component that is dropped (border,
/// max_pixels) does not hide what lies in its holes: that is searched as if the component were
/// absent. The same holds for a frame: a component that fills 9/10 of its bounding box with its
/// holes and less than a quarter of that without, encloses more than a quarter of the region, and
/// has other grains inside.
///
/// Labels: grains with different labels may touch; a grain in a hole of another is a grain of its
/// own, and its pixels count for the other as well. A label in two places makes two grains
/// (segmentation tools restart from 0 when a byte is full).
///
/// The log gets warnings (DEM2D_WARNING) of frames, of a grain that fills its box like the
/// background inside a frame, of labels in two places, and the reason if the set is empty. Errors:
/// NULL_ARGUMENT, OUT_OF_RANGE, NOT_FINITE, OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_image_outlines(const dem2d_env *env, const dem2d_image_desc *desc,
                                            dem2d_outline_set **set);
/// Number of outlines in a set; 0 for NULL.
DEM2D_API int dem2d_outline_set_count(const dem2d_outline_set *set);
/// Outline i of a set. Errors: NULL_ARGUMENT, OUT_OF_RANGE.
DEM2D_API dem2d_result dem2d_outline_set_get(const dem2d_outline_set *set, int i,
                                             dem2d_outline *outline);
/// Release a set; NULL is allowed.
DEM2D_API void dem2d_outline_set_destroy(dem2d_outline_set *set);
/// Measures of an outline of count >= 3 points (m), either orientation. It may touch itself, but no
/// two edges may cross, and it must wind around each point once or not at all. Errors:
/// NULL_ARGUMENT, TOO_FEW_POINTS, NOT_FINITE, CROSSING (the log names two edges and the place),
/// ZERO_AREA, OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_outline_measure(const dem2d_env *env, const dem2d_vec *points,
                                             int count, dem2d_outline_info *info);
/// Difference of two outlines (m), exact up to rounding errors. The inside of an outline that
/// crosses itself follows from the even-odd rule. Errors as above, without CROSSING.
DEM2D_API dem2d_result dem2d_outline_compare(const dem2d_env *env, const dem2d_vec *reference,
                                             int reference_count, const dem2d_vec *other,
                                             int other_count, dem2d_difference *difference);

/* ============================================================================================
   >>api-fitting  Templates from outlines, virtual grains
   ============================================================================================ */

/// How the coefficient reduction tests convexity.
typedef enum dem2d_convexity_test {
    DEM2D_SUFFICIENT, ///< [F] eq. 7: a0/2 >= sum (n^2 - 1) |c_n|; safe, far too strict
    DEM2D_EXACT,      ///< rigorous minimum of rho >= 0
    DEM2D_NO_TEST     ///< leave the series as it is
} dem2d_convexity_test;

/// Reduction of FS coefficients until the shape is convex ([F] sec. 2.3).
typedef struct dem2d_reduction_desc {
    dem2d_convexity_test test; ///< stop when this test holds
    double factor;             ///< multiplies the highest pair (a_n, b_n), in (0, 1); 0 for 0.9
    double tolerance;          ///< >= 0, of a0: smaller pairs become 0; 0 for 1e-6
} dem2d_reduction_desc;

/// Convexity of a Fourier series of a support function.
typedef struct dem2d_convexity {
    double sufficient_margin; ///< m, a0/2 - sum (n^2 - 1) |c_n|: >= 0 proves convexity
    double rho_min_lower;     ///< m, rigorous lower bound of the least radius of curvature
    double rho_min_upper;     ///< m, an attained value of rho, within rounding errors
    bool sufficient;          ///< [F] eq. 7 holds
    bool exact;               ///< rho_min_lower >= 0 within rounding errors: a shape can be created
} dem2d_convexity;

/// Convex hull of count >= 3 points (m) by Andrew's monotone chain, counter-clockwise, without
/// collinear points. hull has room for count points; hull_count gets their number. Errors:
/// NULL_ARGUMENT, TOO_FEW_POINTS, NOT_FINITE, ZERO_AREA (all on one line), OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_polygon_hull(const dem2d_env *env, const dem2d_vec *points, int count,
                                          dem2d_vec *hull, int *hull_count);
/// FS of an outline ([F] sec. 2.3): hull, `samples` uniform support values, least squares. a and b
/// get order + 1 values (m); order 0 to 2^20, samples > 2 order, 0 for 16 order + 64. The series
/// may be non-convex: see dem2d_fourier_reduce. Errors: NULL_ARGUMENT, TOO_FEW_POINTS, NOT_FINITE,
/// OUT_OF_RANGE, ZERO_AREA, OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_fourier_fit(const dem2d_env *env, const dem2d_vec *points, int count,
                                         int order, int samples, double *a, double *b);
/// Convexity of a series: sufficient and exact test. a and b have order + 1 elements (m). Errors:
/// NULL_ARGUMENT, NOT_FINITE, OUT_OF_RANGE (order), ZERO_AREA (a0 not above 0).
DEM2D_API dem2d_result dem2d_fourier_convexity(const double *a, const double *b, int order,
                                               dem2d_convexity *convexity);
/// The paper's reduction ([F] sec. 2.3): multiplies the highest pair above the tolerance by the
/// factor until the test holds. Changes a and b in place; reductions (may be NULL) gets the number
/// of multiplications. Errors: NULL_ARGUMENT, NOT_FINITE, OUT_OF_RANGE, ZERO_AREA (a0 not above 0).
DEM2D_API dem2d_result dem2d_fourier_reduce(double *a, double *b, int order,
                                            const dem2d_reduction_desc *desc, int *reductions);
/// Polybezier of an outline ([P] sec. 4): the knots are support points of the hull in `arcs`
/// uniform directions (3 to 2^20), the tangents are perpendicular to these, and the two tangent
/// lengths of each arc minimise the exact area between arc and outline ([P]'s step 4 uses a swarm:
/// DEM2D_FIT_SWARM). Where possible no arc has a radius of curvature above 20 times the radius of
/// the circle with the hull's area, because nearly flat arcs shorten the stable time step. Long
/// edges of the hull become straight arcs where that is better; the knots between these lie in
/// uniform directions. dem2d_outline_fit can change or drop the bound. control gets 3 * arcs points
/// (m). Errors: NULL_ARGUMENT, TOO_FEW_POINTS, NOT_FINITE, OUT_OF_RANGE, CROSSING, ZERO_AREA,
/// OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_bezier_fit(const dem2d_env *env, const dem2d_vec *points, int count,
                                        int arcs, dem2d_vec *control);

/// Method of a fit; each belongs to the model that is named first.
typedef enum dem2d_fit_method {
    DEM2D_FIT_DEFAULT,         ///< FOURIER: constrained; BEZIER: area; other models have one only
    DEM2D_FIT_REDUCTION,       ///< FOURIER: the paper's reduction by [F] eq. 7
    DEM2D_FIT_REDUCTION_EXACT, ///< FOURIER: the reduction by the exact test
    DEM2D_FIT_FEJER,           ///< FOURIER: (1 - n/(N+1)) p_n of the hull
    DEM2D_FIT_CONSTRAINED,     ///< FOURIER: least squares with rho >= min_radius
    DEM2D_FIT_AREA,            ///< BEZIER: least exact area to the outline
    /// BEZIER: [P] sec. 4, particle swarm with pixel overlap. [P] leaves its settings open: here
    /// inertia .7298 and attraction 1.4962 (Clerc and Kennedy's constriction); birds, moves and
    /// pixels as in the desc. Knots that share a corner of the hull are moved along both edges.
    DEM2D_FIT_SWARM
} dem2d_fit_method;

/// Area to which a fit by DEM2D_FIT_CONSTRAINED or DEM2D_FIT_FEJER is scaled.
typedef enum dem2d_fit_scale {
    DEM2D_SCALE_HULL,  ///< area of the outline's hull: best coverage
    DEM2D_SCALE_GRAIN, ///< area of the outline: right mass
    DEM2D_SCALE_NONE   ///< no scaling
} dem2d_fit_scale;

/// A fit of a template to an outline.
typedef struct dem2d_fit_desc {
    int count;               ///< order, arcs (3 or more) or vertices (3 or more), 0 to 1024; 0: the
                             ///< least that reaches the coverage
    double coverage;         ///< >= 0; wanted coverage, inside (0, 1), if count is 0
    dem2d_shape_type model;  ///< circle, ellipse, polygon, bezier or fourier
    dem2d_fit_method method; ///< DEFAULT or one of the model's
    dem2d_fit_scale scale;   ///< FOURIER
    double min_radius;       ///< CONSTRAINED: least radius of curvature, of a0/2, [0, 1); 0 for 0.1
    bool corners;            ///< CONSTRAINED: min_radius is 0, not its default
    double max_radius;       ///< BEZIER: greatest radius of curvature, >= 1, of the radius of the
                             ///< circle with the hull's area; 0 for 20
    bool unbounded;          ///< BEZIER: any radius of curvature, and knots as in [P]
    uint64_t seed;           ///< SWARM: seed of its random numbers
    int birds;               ///< SWARM: birds that search for each arc, 2 to 256; 0 for 30
    int moves;               ///< SWARM: moves of each bird, 0 to 100000; 0 for 60
    int pixels;              ///< SWARM: px across the hull's circle, 8 to 4096; 0 for 256
} dem2d_fit_desc;

/// Result of a fit.
typedef struct dem2d_fit_report {
    int count;         ///< order, arcs or vertices of the template
    dem2d_pose pose;   ///< of the template on the outline
    double coverage;   ///< 1 - difference / area of the outline
    double difference; ///< m2, area of the symmetric difference
    double hausdorff;  ///< m, see dem2d_difference
    double convexity;  ///< m, proved least radius of curvature; 0 with corners
    double max_radius; ///< m, greatest radius of curvature without edges and straight arcs
    int iterations;    ///< steps of the method in all attempts
} dem2d_fit_report;

/// Fit a template to an outline of count >= 3 points (m), convex or not. report may be NULL. If the
/// arcs can't keep the bound of the radius of curvature, that is no error: report->max_radius is
/// the greatest radius. Errors: NULL_ARGUMENT, TOO_FEW_POINTS, NOT_FINITE, CROSSING (see
/// dem2d_outline_measure), ZERO_AREA, OUT_OF_RANGE (a field outside its range, a method of another
/// model), NOT_REACHED (no count up to 64 reaches the coverage), OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_outline_fit(const dem2d_env *env, const dem2d_vec *points, int count,
                                         const dem2d_fit_desc *desc, dem2d_shape **shape,
                                         dem2d_fit_report *report);
/// Difference between an outline (m) and its radial Fourier series r(t) of an order (0 to 719)
/// about the centroid, for comparison ([F] figs. 4-5): this series is no shape here. Errors as of
/// dem2d_outline_measure, OUT_OF_RANGE (order).
DEM2D_API dem2d_result dem2d_radial_compare(const dem2d_env *env, const dem2d_vec *points,
                                            int count, int order, dem2d_difference *difference);

/// A random grain: amplitudes |(a_n, b_n)| of an FS relative to a0/2.
typedef struct dem2d_virtual_desc {
    double radius;          ///< m, of the circle of equal area, > 0
    double elongation;      ///< amplitude of n = 2, >= 0
    double roundness;       ///< amplitude of n = 3, falling as 1/n^2 to n = 7, >= 0
    double roughness;       ///< amplitude of n = 8, falling as 1/n^2 beyond, >= 0
    const double *spectrum; ///< order + 1 amplitudes >= 0 that replace the three above, or NULL
    double min_radius;      ///< least radius of curvature, of a0/2, [0, 1); 0 for 0.1
    uint64_t seed;          ///< same seed, same grain
} dem2d_virtual_desc;

/// Coefficients of a convex grain with random phases. If the radius of curvature would fall below
/// min_radius, one factor lowers all amplitudes. a and b get order + 1 values (m); order 0 to 2^20.
/// Errors: NULL_ARGUMENT, NOT_FINITE, OUT_OF_RANGE.
DEM2D_API dem2d_result dem2d_fourier_virtual(const dem2d_virtual_desc *desc, int order, double *a,
                                             double *b);

/* ============================================================================================
   >>api-contact  Contact of two shapes, of a shape and a wall
   ============================================================================================ */

/// State of a pair.
typedef enum dem2d_contact_state {
    DEM2D_SEPARATED,   ///< a gap, above rounding errors
    DEM2D_TOUCHING,    ///< gap or overlap within rounding errors, or the deviations of both
    DEM2D_PENETRATING, ///< an overlap, above rounding errors
    DEM2D_UNRESOLVED   ///< the limit of iterations was reached; depth and error are still bounds
} dem2d_contact_state;

/// How depth and distance are found.
typedef enum dem2d_solver {
    DEM2D_CERTIFIED, ///< minimum of the support value by Newton's steps, proved global
    /// The papers' method: GJK, then EPA if the shapes overlap. A world then collides every pair
    /// whose bounding circles overlap in every step, circles too, from the line of centres.
    DEM2D_GJK_EPA,
    DEM2D_SOLVER_COUNT
} dem2d_solver;

/// What proves that an answer is the least overlap, or the greatest gap, to its error bound.
typedef enum dem2d_proof {
    DEM2D_BY_NOTHING,  ///< the limit of iterations was reached: the bounds hold, but are wide
    DEM2D_BY_FORM,     ///< closed form: circles, walls, edges and corners of two polygons
    DEM2D_BY_RADIUS,   ///< the depth is below the least radius of curvature; or a gap
    DEM2D_BY_ARC,      ///< least radii of curvature beside the contact exclude other directions
    DEM2D_BY_POLYTOPE, ///< branch and bound over arcs of directions, or EPA
    DEM2D_PROOF_COUNT
} dem2d_proof;

/// Options of a contact query; all zero for the defaults.
typedef struct dem2d_contact_desc {
    double tolerance;    ///< wanted error, >= 0, of R_A + R_B + |d|; 0 for 1e-10
    int max_iterations;  ///< of each search, >= 0; 0 for 128; a polytope takes 250 at most
    dem2d_vec start;     ///< first direction, e.g. the last normal; 0 for the line of centres
    dem2d_solver solver; ///< certified, or GJK and EPA
    bool skip_points;    ///< compute no contact points: count is 0, faster
} dem2d_contact_desc;

/// One of the points that carry a contact.
typedef struct dem2d_contact_point {
    dem2d_vec position; ///< m
    dem2d_vec normal;   ///< unit, direction of the force on B; at the deepest point the contact's
    double depth;       ///< m, overlap there, at a right angle to the face of the other shape
    double weight;      ///< force there over kn depth: 1 except where the common part is short
    double energy;      ///< m2, energy stored there over kn; the sum is the contact's
    /// Number of the corner where the point is, the same in every pose, so that a spring can be
    /// kept from step to step: 2 i for A, 2 i + 1 for B, with i the edge or arc whose
    /// counter-clockwise end (up to the next straight arc) is the corner. If A and B are exchanged,
    /// the last bit changes. -1 for one point.
    int corner;
} dem2d_contact_point;

/// Answer to a contact query, in the coordinates of the poses.
typedef struct dem2d_contact {
    dem2d_contact_state state;     ///< separated, touching, penetrating or unresolved
    dem2d_proof proof;             ///< why the error bound holds
    int support_calls;             ///< evaluations of the support function of A minus B
    int iterations;                ///< of all searches together
    dem2d_vec normal;              ///< unit, from A to B
    double depth;                  ///< m, overlap along the normal; negative: minus the gap
    double error;                  ///< m, the true depth differs from depth by this at most
    double residual;               ///< m, last residual of EPA, |W| less least edge distance; or 0
    dem2d_vec point_a;             ///< m, witness point on A
    dem2d_vec point_b;             ///< m, witness point on B
    dem2d_vec point;               ///< m, the middle of the two; at a wall the foot point, point_b
    int count;                     ///< contact points: 0 if separated, 2 where two faces meet
    dem2d_contact_point points[2]; ///< sorted along the normal turned by +90 degrees
} dem2d_contact;

/// Whether a point (m) lies in a shape, boundary included, within rounding errors. Errors:
/// NULL_ARGUMENT, NOT_FINITE, OUT_OF_RANGE (pose, sizes).
DEM2D_API dem2d_result dem2d_shape_contains(const dem2d_shape *shape, dem2d_pose pose,
                                            dem2d_vec point, bool *inside);
/// Whether two shapes overlap: GJK stops at the first direction that separates them or the first
/// simplex that contains the origin ([P] sec. 3.1). Only state, counts, and bounds are meaningful:
/// depth is the least support value found, error its distance from a lower bound. desc may be NULL.
/// Errors of all pair queries: NULL_ARGUMENT, NOT_FINITE, OUT_OF_RANGE (desc, pose, sizes whose
/// squares are not normal numbers).
DEM2D_API dem2d_result dem2d_pair_overlap(const dem2d_shape *a, dem2d_pose pose_a,
                                          const dem2d_shape *b, dem2d_pose pose_b,
                                          const dem2d_contact_desc *desc, dem2d_contact *contact);
/// Distance by GJK, whatever the solver: gap, normal and witness points of separated shapes. For
/// overlapping shapes the answer is that of dem2d_pair_overlap. desc may be NULL.
DEM2D_API dem2d_result dem2d_pair_distance(const dem2d_shape *a, dem2d_pose pose_a,
                                           const dem2d_shape *b, dem2d_pose pose_b,
                                           const dem2d_contact_desc *desc, dem2d_contact *contact);
/// Distance or depth, with the contact points. Certified: a closed form for two circles (0 support
/// calls), edges and corners for two polygons or a polygon and a circle, for all others Newton's
/// steps on the support value, from desc->start or the line of centres. desc may be NULL.
DEM2D_API dem2d_result dem2d_pair_contact(const dem2d_shape *a, dem2d_pose pose_a,
                                          const dem2d_shape *b, dem2d_pose pose_b,
                                          const dem2d_contact_desc *desc, dem2d_contact *contact);
/// A shape at a pose.
typedef struct dem2d_body {
    const dem2d_shape *shape; ///< stays the caller's
    dem2d_pose pose;          ///< rotations of length 1 are faster
} dem2d_body;

/// A pair of bodies, by their indices.
typedef struct dem2d_body_pair {
    int a; ///< index of A
    int b; ///< index of B, not that of A
} dem2d_body_pair;

/// What a query of a pair keeps for the next query of the same pair. The caller only stores it. Any
/// content is allowed: that of another pair or garbage costs time, and never gives a wrong answer.
typedef struct dem2d_contact_memory {
    dem2d_vec normal; ///< of the last query; {0, 0}: nothing is known
    int feature[3];   ///< of two polygons in contact: whose edge, corners of A and B
} dem2d_contact_memory;

/// The short answer to a contact query: as dem2d_contact.
typedef struct dem2d_overlap {
    dem2d_vec normal;          ///< unit, from A to B
    dem2d_vec point;           ///< m, the middle of the two witness points
    double depth;              ///< m, overlap along the normal; negative: minus the gap
    double error;              ///< m, the true depth differs from depth by this at most
    dem2d_contact_state state; ///< separated, touching, penetrating or unresolved
} dem2d_overlap;

/// dem2d_pair_contact of pair_count pairs of body_count bodies. Each answer is that of the single
/// query, to its error. memory (pair_count, or NULL: nothing is known) is read and renewed;
/// desc->start is for pairs whose memory is empty. The answers go to overlaps (pair_count) and
/// contacts (pair_count); one of them may be NULL: not wanted. Threads may share bodies and ask for
/// different pairs. Errors, which leave all arrays as they were: NULL_ARGUMENT, NOT_FINITE,
/// OUT_OF_RANGE (desc, counts, indices, poses; coordinates and radii above 1e153 m, radii below
/// 1e-138 m). env (may be NULL) gets the log.
DEM2D_API dem2d_result dem2d_pairs_contact(const dem2d_env *env, const dem2d_body *bodies,
                                           int body_count, const dem2d_body_pair *pairs,
                                           int pair_count, const dem2d_contact_desc *desc,
                                           dem2d_contact_memory *memory, dem2d_overlap *overlaps,
                                           dem2d_contact *contacts);
/// Contact of a shape A and a half-plane B: one support call, exact. `point` (m) is on the wall's
/// surface, `wall_normal` (any length but 0) points out of the wall, towards the shapes. Errors:
/// NULL_ARGUMENT, NOT_FINITE, OUT_OF_RANGE (pose, zero normal).
DEM2D_API dem2d_result dem2d_wall_contact(const dem2d_shape *shape, dem2d_pose pose,
                                          dem2d_vec point, dem2d_vec wall_normal,
                                          dem2d_contact *contact);

/* ============================================================================================
   >>api-world  Particles, walls, materials, steps
   ============================================================================================ */

/// A scene. Opaque. Only one call at a time.
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

/// Where the forces of a contact act.
typedef enum dem2d_face_rule {
    DEM2D_TWO_POINTS, ///< both ends of the common part where two faces meet, else one point
    /// The papers' rule: one point, the middle of both witness points ([P] fig. 4a); at a wall, the
    /// middle of support point and foot point (fig. 4b). The other rules take the foot point there.
    DEM2D_ONE_POINT,
    DEM2D_FACE_RULE_COUNT
} dem2d_face_rule;

/// Part of a step that parallel work belongs to, for profiles.
typedef enum dem2d_phase {
    DEM2D_PHASE_LIST,     ///< candidate pairs, when the list is rebuilt; the time step check
    DEM2D_PHASE_CONTACTS, ///< geometry and forces of the listed contacts
    DEM2D_PHASE_MOTION,   ///< sums of forces per particle, new velocities and positions
    DEM2D_PHASE_COUNT
} dem2d_phase;

/// A piece of work: items begin to end - 1. Different ranges may run at the same time.
typedef void dem2d_task_fn(void *context, int begin, int end);

/// Calls task(context, begin, end) for ranges that cover 0 to count - 1 once, on any threads, in
/// any number and order, and returns when all are done. An item is a block of 64 or more contacts
/// or particles, or, if count is 1, work that can't be divided. user is the desc's parallel_user.
typedef void dem2d_parallel_fn(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                               void *context);

/// A material. A contact of two materials has the harmonic mean of their stiffnesses (springs in
/// series, doubled), the smaller friction coefficients and the greater damping ratio, unless
/// dem2d_world_set_pair sets others.
typedef struct dem2d_material_desc {
    double density;              ///< kg/m2 (kg/m3 per metre of thickness), > 0; walls ignore it
    double normal_stiffness;     ///< N/m, > 0
    double tangential_stiffness; ///< N/m, >= 0; 0: neither friction nor rolling friction
    double friction;             ///< coefficient, >= 0
    double damping_ratio;        ///< of the normal dashpot, >= 0: see dem2d_damping_ratio
    double rolling_friction;     ///< coefficient, >= 0
} dem2d_material_desc;

/// Properties of the contacts of two materials.
typedef struct dem2d_pair_desc {
    double normal_stiffness;     ///< N/m, > 0
    double tangential_stiffness; ///< N/m, >= 0; 0: neither friction nor rolling friction
    double friction;             ///< coefficient, >= 0
    /// Damping ratio zeta of the normal dashpot, >= 0: its force is 2 zeta sqrt(m kn) times the
    /// approach speed, with m the reduced mass. Spring and dashpot together never pull.
    double damping_ratio;
    /// Coefficient mu_r, >= 0: a rolling spring kt R^2 whose moment is at most mu_r R times the
    /// normal force, with 1/R = 1/R_A + 1/R_B of the equivalent radii (infinite for a wall).
    double rolling_friction;
} dem2d_pair_desc;

/// A contact as a caller's law gets it. Velocities are those of the last step, half a step before
/// the positions, whatever has been set since.
typedef struct dem2d_law_input {
    dem2d_pair_desc pair; ///< properties of contacts of the two materials
    dem2d_particle_id a;  ///< particle A
    dem2d_particle_id b;  ///< particle B; generation 0 when B is a wall
    dem2d_wall_id wall;   ///< wall B; generation 0 when B is a particle
    dem2d_vec normal;     ///< unit, from A to B
    double time_step;     ///< s, of the last step: sliding times it is the distance slid
    double depth;         ///< m, > 0
    double approach;      ///< m/s, approach speed of A and B along the normal
    /// m/s, sliding velocity of B relative to A along the normal turned by +90 degrees: mean of the
    /// step, see Sliding in the manual.
    double sliding;
    double spin;             ///< rad/s, spin of B relative to A
    double mass;             ///< kg/m, reduced; 0 for a servo wall and a particle that is not free
    double radius;           ///< m, reduced, of the equivalent radii
    double tangential_force; ///< N/m, in the step before; 0 for a new contact
    double moment;           ///< N, likewise
    double state[2];         ///< as the law left it in the step before; 0 for a new contact
} dem2d_law_input;

/// Forces that a caller's law returns; at the call all zero, except the state: that of the input.
typedef struct dem2d_law_output {
    double normal_force;     ///< N/m, on B along the normal; below 0 it pulls, while depth > 0
    double tangential_force; ///< N/m, on B along the normal turned by +90 degrees
    double moment;           ///< N, on B
    double energy;           ///< J/m, stored in the contact, for the energies
    double state[2];         ///< for the next step
} dem2d_law_output;

/// A contact law: forces of a contact. It is called while depth > 0, by the threads of
/// parallel_for. When the shapes separate, its force ends and its state is dropped. For a contact
/// with a servo wall it is called once more in each step, by the calling thread, with a little more
/// depth and approach speed: the wall needs to know how the force will rise, and uses nothing else
/// of that answer.
typedef void dem2d_law_fn(void *user, const dem2d_law_input *input, dem2d_law_output *output);

/// Sums of the contact forces of a step, for a callback that may change them. Rows of particles are
/// by the index of their id, those of walls by the index of the wall's; of free ids they are 0.
typedef struct dem2d_sums {
    int particles;         ///< rows of the next two
    dem2d_vec *force;      ///< N/m, on each particle, without gravity
    double *torque;        ///< N, likewise, about the centroid
    int walls;             ///< rows of the next
    dem2d_vec *wall_force; ///< N/m, of the particles on each wall
} dem2d_sums;

/// Called in each step when the contact forces are summed up, before anything moves, by the thread
/// that called the step. What it leaves in the sums moves the particles, enters the ledger, and is
/// the force on the walls; queries go on to describe the contacts. (A servo wall answers to its own
/// contacts.) It must not call functions of this world. A step that is refused, or runs out of
/// memory, may be tried again, with another call.
typedef void dem2d_gather_fn(void *user, dem2d_sums *sums);

/// Called once for each step that is tried, after all checks and before anything changes, with the
/// result so far: an error when the step can't be made, maybe before the call of dem2d_gather_fn.
/// Returns DEM2D_OK if the step is to be made, else what dem2d_world_step then returns: the world
/// stays as it was before the step. An error that it gets is an error whatever it returns. It must
/// not call functions of this world.
typedef dem2d_result dem2d_commit_fn(void *user, dem2d_result result);

/// Sets external loads: called at the start of each step that is tried, by the thread that called
/// the step. It may call queries and dem2d_world_set_load of this world: positions are those of the
/// force pass that follows, velocities those of half a step before. When a step fails, it is called
/// again in the next try; the loads stay as it has set them.
///
/// A load that depends on the velocity is of first order in the time step: F = -c v has the factor
/// 1 - c dt/m on v in each step, so that c dt/m must be below 1 (from 2 on it is unstable); for a
/// terminal velocity g m/c take it below 0.01. A load that depends on the position is a spring that
/// the bounds of the time step do not know: k dt^2/m must be below 4.
typedef void dem2d_loads_fn(void *user, dem2d_world *world);

/// A world. Only time_step has no default.
typedef struct dem2d_world_desc {
    double time_step;          ///< s, > 0
    dem2d_vec gravity;         ///< m/s2
    double local_damping;      ///< Cundall's factor, [0, 1)
    double global_damping;     ///< 1/s, viscous, >= 0
    double skin;               ///< of the neighbour list, >= 0, of the particle radius; 0: tuned
    double contact_tolerance;  ///< >= 0, of R_A + R_B + |d|; 0 for 1e-8
    int max_iterations;        ///< of each search, 0 to 2^30; 0 for 128
    dem2d_solver solver;       ///< of contacts: certified, or GJK and EPA
    dem2d_face_rule faces;     ///< where forces act
    int particle_capacity;     ///< reserved at creation, 0 to 2^30; 0 grows
    int pair_capacity;         ///< reserved at creation, 0 to 2^30; 0 grows
    bool skip_time_step_check; ///< no stability check
    bool ledger;               ///< keep the ledger of energies, see dem2d_world_ledger
    /// Replaces springs, dashpot and friction, and contacts have one point. NULL for the built-in.
    dem2d_law_fn *law;
    void *law_user;                  ///< passed to law
    int law_tag;                     ///< identifies law in snapshots
    dem2d_parallel_fn *parallel_for; ///< distributes the work of a step; NULL: the calling thread
    void *parallel_user;             ///< passed to parallel_for
    const dem2d_env *env;            ///< memory and log, copied; NULL for malloc, free, silence
    dem2d_gather_fn *gather;         ///< may change the sums of contact forces; NULL: none
    dem2d_commit_fn *commit;         ///< may refuse a step; NULL: none
    void *exchange_user;             ///< passed to gather and commit
    dem2d_loads_fn *loads;           ///< sets external loads in each step; NULL: none
    void *loads_user;                ///< passed to loads
} dem2d_world_desc;

/// How a particle moves. Two particles that are not free have no contact with each other, nor with
/// a wall without servo control: no force can move the two against each other.
typedef enum dem2d_motion {
    DEM2D_FREE,  ///< by the forces on it
    DEM2D_FIXED, ///< not at all
    DEM2D_DRIVEN ///< at given velocities, whatever the forces
} dem2d_motion;

/// A particle. Errors name the field.
typedef struct dem2d_particle_desc {
    double scale;               ///< size factor on the template, > 0
    dem2d_shape_id shape;       ///< template, of this world
    dem2d_material_id material; ///< material, of this world
    dem2d_motion motion;        ///< free, fixed or driven
    dem2d_vec position;         ///< m, of the centroid
    double angle;               ///< rad, -2^30 to 2^30
    dem2d_vec velocity;         ///< m/s, half a step before the position; 0 when FIXED
    double angular_velocity;    ///< rad/s, likewise
    uint64_t name;              ///< orders pairs and sums: see Name in the manual; 0: none
} dem2d_particle_desc;

/// State of a particle.
typedef struct dem2d_particle_info {
    dem2d_shape_id shape;       ///< template
    dem2d_material_id material; ///< material
    dem2d_motion motion;        ///< free, fixed or driven
    dem2d_pose pose;            ///< now
    dem2d_vec velocity;         ///< m/s, half a step before the pose, or as it has been set since
    double angular_velocity;    ///< rad/s, likewise
    dem2d_vec force;            ///< N/m, sum over contacts in the last force pass (no gravity)
    double torque;              ///< N, likewise, about the centroid
    double mass;                ///< kg/m
    double inertia;             ///< kg m, about the centroid
    double radius;              ///< m, bounding circle
    double equivalent;          ///< m, radius of the circle of equal area
    uint64_t name;              ///< as given
    dem2d_vec load;             ///< N/m, external, as it is set
    double load_torque;         ///< N, likewise
} dem2d_particle_info;

/// How a wall moves.
typedef enum dem2d_wall_mode {
    DEM2D_WALL_STILL,  ///< not at all
    DEM2D_WALL_MOVING, ///< at a given velocity
    DEM2D_WALL_SERVO   ///< along its normal, so that force = stress * length: see dem2d_wall_desc
} dem2d_wall_mode;

/// A half-plane, or a segment. Segments push to both sides and at their ends. Two ends nearer than
/// a millionth of the shorter segment are a joint: a particle there has one contact.
///
/// A servo wall moves along its normal so that particles press on it with F = stress * length. In
/// each step it chooses the speed V for which the springs and dashpots of its contacts have the sum
///     F - b (V - D),   b = the greater of 0.2 sqrt(K M) and K dt/4
/// in the next force pass. K is the stiffness of its contacts and M the mass of their particles,
/// whose own next step is taken into account. b damps the vibration of the contacts. D is the mean
/// of V over the last 10 sqrt(M/K), so that the mean force is right while the particles yield
/// steadily; D decays where everything between two facing servo walls drifts. The control is
/// stable for every damping ratio and max_speed if the time step is stable for the particles.
///
/// |V| is at most max_speed. A wall that has touched nothing yet moves at max_speed: its first
/// contact presses with up to (kn dt + c) max_speed in one step, c of the dashpot. A wall that has
/// lost contact returns at a lower speed, for which this force is F at most, and accelerates over
/// about 10 sqrt(M/K). max_speed must be above the speed at which the particles yield, or F is not
/// reached. The normal of a segment is to the left of the direction from point to end: a stress
/// above 0 presses on particles there, and particles on the other side press against it. A wall
/// with stress 0 yields to particles that press on it, and stands still without any; below 0 it
/// moves away, unless a law of yours pulls.
typedef struct dem2d_wall_desc {
    double length;        ///< m, >= 0, for the stress of a servo half-plane without spans: then > 0
    dem2d_wall_mode mode; ///< still, moving, servo
    dem2d_material_id material; ///< friction and stiffness (its density is not used)
    dem2d_vec point;            ///< m, on the surface; of a segment the start
    dem2d_vec normal;           ///< out of the wall, towards the grains; any length but 0
    bool segment;               ///< from point to end; its normal is to the left, `normal` ignored
    dem2d_vec end;              ///< m, of a segment, not its point
    dem2d_vec velocity;         ///< m/s, for MOVING, else 0
    double stress;              ///< Pa, for SERVO, else 0; compression positive
    double max_speed; ///< m/s, >= 0, for SERVO > 0: greatest speed, taken before first contact
    dem2d_wall_id spans[2]; ///< the length is the distance between these walls; or both zero
    uint64_t name;          ///< orders contacts and sums: see Name in the manual; 0: none
} dem2d_wall_desc;

/// State of a wall.
typedef struct dem2d_wall_info {
    dem2d_wall_mode mode;       ///< still, moving, servo
    dem2d_material_id material; ///< as given
    dem2d_vec point;            ///< m, on the surface, now
    dem2d_vec normal;           ///< unit, towards the grains; of a segment to its left
    bool segment;               ///< from point to end
    dem2d_vec end;              ///< m, now; of a half-plane the point
    dem2d_vec velocity;         ///< m/s, of a servo wall half a step before the point; else as set
    dem2d_vec force;            ///< N/m, of the particles on the wall in the last force pass
    double length;              ///< m, at the last force pass; 0 when neither length nor spans
    double stress;              ///< Pa, -force . normal / length; 0 when there is no length
    double target;              ///< Pa, for SERVO
    uint64_t name;              ///< as given
} dem2d_wall_info;

/// One contact of the last force pass.
typedef struct dem2d_contact_info {
    dem2d_particle_id a;     ///< particle A
    dem2d_particle_id b;     ///< particle B; generation 0 when B is a wall
    dem2d_wall_id wall;      ///< wall B; generation 0 when B is a particle
    dem2d_vec normal;        ///< unit, from A to B; of two points that of their force
    dem2d_vec point;         ///< m, contact point; of two the centre of normal force
    dem2d_vec branch;        ///< m, centre of A to centre of B (wall: to the contact point)
    int points;              ///< that carry the force: 1, or 2 where two faces meet
    double depth;            ///< m, overlap
    double normal_force;     ///< N/m, on B along the normal; >= 0 but by a caller's law
    double tangential_force; ///< N/m, on B along the normal turned by +90 degrees
    double moment;           ///< N, on B, against rolling
    int part_a;              ///< part of A in contact: 0, since every particle has one part
    int part_b;              ///< part of B: of a wall by its number, of a particle 0
    int shift[2]; ///< cells from A to the image of B: {0, 0}, since no direction is periodic
    int feature;  ///< distinguishes contacts of the same two parts: 0, since they have one
    int sign;     ///< 1 if the force of the contact is added, -1 if it is subtracted: 1
} dem2d_contact_info;

/// Counters of a world.
typedef struct dem2d_stats {
    int64_t steps;         ///< done since creation
    double time;           ///< s, the sum of their time steps
    int64_t list_rebuilds; ///< of the neighbour list
    int64_t support_calls; ///< in all steps
    int64_t collisions;  ///< of pairs whose bounding circles overlap and are not skipped, all steps
    int64_t separations; ///< collisions that found the pair separated
    int64_t proofs[DEM2D_PROOF_COUNT]; ///< number of the other collisions, by their proof
    int64_t not_converged;             ///< contacts whose search reached its limit, in all steps
    int64_t slow_time_step;            ///< checks that found the time step above the safe bound
    int64_t fast_motion;               ///< checks that found a particle fast enough to pass others
    int particles;                     ///< number of particles
    int walls;                         ///< number of walls
    int pairs;                         ///< in the neighbour list, walls included
    int contacts;                      ///< between particles in the last force pass
    int wall_contacts;                 ///< with walls in the last force pass
    double skin;                       ///< of the neighbour list, of the particle radius
    size_t bytes;                      ///< in use, all of the world
} dem2d_stats;

/// Create a world; *world is the caller's, to be released by dem2d_world_destroy. Errors:
/// NULL_ARGUMENT, NOT_FINITE, OUT_OF_RANGE, OUT_OF_MEMORY.
///
/// Errors of all functions of a world: NULL_ARGUMENT; STALE_ID for the id of a removed object;
/// OUT_OF_MEMORY where something is added; NOT_FINITE and OUT_OF_RANGE for numbers.
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
DEM2D_API dem2d_result dem2d_world_add_material(dem2d_world *world, const dem2d_material_desc *desc,
                                                dem2d_material_id *id);
/// Damping ratio zeta of the dashpot that gives a restitution coefficient in (0, 1] at any speed,
/// without attraction: -ln e = 2 zeta acos(zeta)/sqrt(1 - zeta^2), and likewise with acosh beyond
/// zeta = 1 (Schwager, Poeschel 2007). It holds for central impacts at one point, in the limit of
/// small time steps, with an error of first order: with steps of a tenth of the contact time 0.8
/// becomes 0.8067, because the force of a dashpot starts with a jump. Where two faces meet, two
/// contact points have twice the stiffness and twice the dashpot. Errors: NULL_ARGUMENT,
/// OUT_OF_RANGE, NOT_FINITE.
DEM2D_API dem2d_result dem2d_damping_ratio(double restitution, double *damping_ratio);
/// Set the properties of contacts of two materials (or of one with itself), from now on. Forces in
/// queries stay those of the last force pass; energies and bounds of the time step use the new
/// properties at once.
DEM2D_API dem2d_result dem2d_world_set_pair(dem2d_world *world, dem2d_material_id a,
                                            dem2d_material_id b, const dem2d_pair_desc *desc);
/// Add a particle.
DEM2D_API dem2d_result dem2d_world_add_particle(dem2d_world *world, const dem2d_particle_desc *desc,
                                                dem2d_particle_id *id);
/// Remove a particle and its contacts.
DEM2D_API dem2d_result dem2d_world_remove_particle(dem2d_world *world, dem2d_particle_id id);
/// State of a particle.
DEM2D_API dem2d_result dem2d_world_get_particle(const dem2d_world *world, dem2d_particle_id id,
                                                dem2d_particle_info *info);
/// Move a particle to a position (m) and angle (rad); its contacts lose their history.
DEM2D_API dem2d_result dem2d_world_move_particle(dem2d_world *world, dem2d_particle_id id,
                                                 dem2d_vec position, double angle);
/// Set the velocities (m/s, rad/s) and the kind of motion of a particle, from its next move on: the
/// springs and dashpots of the next force pass still use the velocities of the last move. Errors:
/// NOT_FINITE, OUT_OF_RANGE, OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_world_drive_particle(dem2d_world *world, dem2d_particle_id id,
                                                  dem2d_motion motion, dem2d_vec velocity,
                                                  double angular_velocity);
/// Set the external load of a particle, from the next step until it is set again: a force (N/m) at
/// its centroid and a torque (N). It moves free particles only. Its work is an account of the
/// ledger. Set it in dem2d_world_desc.loads if it changes from step to step. Errors: NOT_FINITE,
/// OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_world_set_load(dem2d_world *world, dem2d_particle_id id,
                                            dem2d_vec force, double torque);
/// Add a wall.
DEM2D_API dem2d_result dem2d_world_add_wall(dem2d_world *world, const dem2d_wall_desc *desc,
                                            dem2d_wall_id *id);
/// Replace a wall's description. Its contacts keep their history, unless the wall turns by a right
/// angle or more, or changes between half-plane and segment.
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
/// Change the time step (s, > 0) from the next move on.
DEM2D_API dem2d_result dem2d_world_set_time_step(dem2d_world *world, double time_step);
/// Bounds of the stable time step (s) for the contacts of the last force pass. While these contacts
/// stay, a time step at or below `safe` is stable, one above `limit` is not. Without contacts
/// `limit` is HUGE_VAL, and `safe` assumes one contact per particle. Nearly flat arcs under a force
/// lower both bounds, because they resist rocking. limit_particle (may be NULL) gets the particle
/// that sets the limit, generation 0 if none.
///
/// A contact that closes and opens again returns between 1 - q and 1/(1 - q) of its energy,
/// q = (dt/safe)^2, at random (1 % at a tenth of `safe`, 7 % at a quarter): without damping and
/// friction, grains that bounce for a long time may gain energy at any time step, more with a
/// longer one.
DEM2D_API dem2d_result dem2d_world_time_step_bounds(const dem2d_world *world, double *safe,
                                                    double *limit,
                                                    dem2d_particle_id *limit_particle);
/// Take count >= 0 steps; done (may be NULL) gets the number taken, also on failure. Errors: STATE,
/// TIME_STEP, OUT_OF_MEMORY, OUT_OF_RANGE, IN_USE (called by a callback of this world), what
/// dem2d_world_desc.commit returns; the world then is as it was before the step that failed.
DEM2D_API dem2d_result dem2d_world_step(dem2d_world *world, int count, int *done);

/* ============================================================================================
   >>api-measures  Queries: lists, energy, stress, fabric, packing, distance from rest
   ============================================================================================ */

/// Energies of the last force pass, J/m.
typedef struct dem2d_energy {
    double translational; ///< kinetic, mean of the half steps before and after
    double rotational;    ///< likewise
    double normal;        ///< in normal springs
    double tangential;    ///< in tangential springs
    double rolling;       ///< in springs against rolling
    double potential;     ///< -sum m g.x
} dem2d_energy;

/// Energy balance, J/m: stored energies at the last force pass, all other accounts since the first
/// step. The kinetic energy is half the mass times the velocity half a step before times the
/// velocity half a step after: with it the leapfrog conserves the energy of a spring exactly.
typedef struct dem2d_ledger {
    double kinetic;    ///< of the free particles
    double normal;     ///< in normal springs
    double tangential; ///< in tangential springs and those against rolling
    double gravity;    ///< work of gravity on the free particles
    double walls;      ///< work of the walls on the particles
    double driven;     ///< work of the driven particles on the others
    double friction;   ///< dissipated by sliding and rolling, and by a caller's law
    double dashpot;    ///< dissipated by dashpots
    double damping;    ///< dissipated by local and global damping
    /// Put in by the caller: at the start, and by changes of objects, velocities and laws. The
    /// first step after a change adds here what closes the balance over that step.
    double given;
    /// Stored and dissipated energy less what was put in: the error of the time stepping, of second
    /// order in the time step. With a time step of 1/32 of the shortest contact it is below 3e-4 of
    /// the turnover; with sharp corners and segments below 1e-3.
    double closure;
    /// Energy that has gone from one account to another: half the sum of the absolute changes in
    /// each step of all accounts except `given`. The first step after a change by the caller adds
    /// nothing.
    double turnover;
    double loads; ///< work of the external loads on the free particles
} dem2d_ledger;

/// Stress tensor, compression positive, Pa.
typedef struct dem2d_stress {
    double xx; ///< normal, x
    double xy; ///< force along y across a face with normal x
    double yx; ///< force along x across a face with normal y
    double yy; ///< normal, y
} dem2d_stress;

/// Mean and deviator of a stress in the plane.
typedef struct dem2d_principal {
    double p;     ///< Pa, (s1 + s2)/2
    double q;     ///< Pa, (s1 - s2)/2, >= 0
    double angle; ///< rad in (-pi/2, pi/2], direction of s1, the greater one, from x; 0 if q is 0
} dem2d_principal;

/// Numbers of a packing at the last force pass.
typedef struct dem2d_packing {
    double coordination;        ///< contacting neighbours per particle, walls not counted
    double coordination_loaded; ///< the same over the particles with at least two contacts
    double mean_overlap;        ///< overlap / equivalent radius of the smaller particle, mean
    double max_overlap;         ///< the same, greatest (with walls: of the particle)
    double solid_area;          ///< m2, sum of the particles' areas
    int rattlers;               ///< particles with fewer than two contacts, walls not counted
} dem2d_packing;

/// Anisotropy of second order: 1 + coefficient cos 2 (angle - direction).
typedef struct dem2d_anisotropy {
    double coefficient; ///< >= 0
    double direction;   ///< rad in (-pi/2, pi/2]; 0 if the coefficient is 0
} dem2d_anisotropy;

/// Fabric of the contacts between particles at the last force pass; all 0 without contacts. Means
/// of lengths and forces by direction are divided by the density of contacts in that direction
/// (Rothenburg, Bathurst 1989; Guo, Zhao 2013), taken as 1 + a_c cos, but not below 0.1.
typedef struct dem2d_fabric {
    int contacts;                       ///< number of them
    double xx;                          ///< (1/N) sum of n n, with n the unit normals
    double xy;                          ///< likewise
    double yy;                          ///< likewise
    double deviator;                    ///< difference of the principal values of this tensor
    double mean_branch;                 ///< m, from centre to centre, along the normal
    double mean_force;                  ///< N/m, normal
    dem2d_anisotropy normals;           ///< a_c: where the contacts are
    dem2d_anisotropy branches;          ///< a_b: of the branches along the normal
    dem2d_anisotropy branch_tangents;   ///< a_bt: across it, -mean a_bt sin 2 (angle - direction)
    dem2d_anisotropy normal_forces;     ///< a_n
    dem2d_anisotropy tangential_forces; ///< a_t: f_t = -f0 a_t sin 2 (angle - direction)
    /// Predicted q/p: (a_c + a_b + a_bt + a_n + a_t)/2, of the parts along the direction of a_c.
    double stress_ratio;
} dem2d_fabric;

/// What a histogram counts or averages. Directions of normals are in [0, 2 pi); each contact
/// between particles counts twice, with opposite normals.
typedef enum dem2d_histogram {
    DEM2D_HISTOGRAM_COORDINATION, ///< particles with 0, 1, .. bins - 1 or more contacts, no walls
    DEM2D_HISTOGRAM_ORIENTATION,  ///< particles by their long axis ([P] alignment), in [0, pi);
                                  ///< particles without a long axis do not count
    DEM2D_HISTOGRAM_NORMAL,       ///< contacts by the direction of their normal
    DEM2D_HISTOGRAM_ALONG_BRANCH, ///< contacts by contact branch orientation: from centre to centre
    DEM2D_HISTOGRAM_BRANCH,       ///< m, mean branch along the normal, by the normal's direction
    DEM2D_HISTOGRAM_NORMAL_FORCE, ///< N/m, mean by the direction of the normal
    DEM2D_HISTOGRAM_TANGENTIAL_FORCE, ///< N/m, signed (see dem2d_contact_info), likewise
    DEM2D_HISTOGRAM_COUNT
} dem2d_histogram;

/// Distance of a world from static equilibrium, at the last force pass.
typedef struct dem2d_equilibrium {
    double mean_speed;    ///< m/s, of the centroids of particles that are not fixed
    double max_speed;     ///< m/s
    double kinetic_ratio; ///< the papers' relative kinetic energy: kinetic over spring energy; 0 at
                          ///< rest, HUGE_VAL without contacts
    /// mean |contact forces + weight + external load| of free particles / mean contact force
    double unbalanced;
} dem2d_equilibrium;

/// Counters of a world. Errors: NULL_ARGUMENT; so for all queries.
DEM2D_API dem2d_result dem2d_world_stats(const dem2d_world *world, dem2d_stats *stats);
/// Ids of all particles, sorted by index: the first `capacity` of them go into ids (may be NULL if
/// capacity is 0); count gets the number of particles. Errors: OUT_OF_RANGE (capacity below 0).
DEM2D_API dem2d_result dem2d_world_particles(const dem2d_world *world, dem2d_particle_id *ids,
                                             int capacity, int *count);
/// Contacts of the last force pass, first of two particles, then with walls, each sorted by A, then
/// by B, in the order of names and ids: the first `capacity` of them go into contacts (may be NULL
/// if capacity is 0); count gets the number of contacts. Errors: OUT_OF_RANGE (capacity below 0).
DEM2D_API dem2d_result dem2d_world_contacts(const dem2d_world *world, dem2d_contact_info *contacts,
                                            int capacity, int *count);
/// Energies at the last force pass, of springs as their materials are now.
DEM2D_API dem2d_result dem2d_world_energy(const dem2d_world *world, dem2d_energy *energy);
/// The energy balance of a world with desc.ledger. Errors: OUT_OF_RANGE for a world without it.
DEM2D_API dem2d_result dem2d_world_ledger(const dem2d_world *world, dem2d_ledger *ledger);
/// Love-Weber stress: (1/area) times the sum of f l over the contacts, walls included; area > 0,
/// m2. Errors: NOT_FINITE, OUT_OF_RANGE (area).
DEM2D_API dem2d_result dem2d_world_stress(const dem2d_world *world, double area,
                                          dem2d_stress *stress);
/// Stress in a particle: (1/its area) times the sum of arm and force over its contacts, walls
/// included. The sum over all particles of stress times area is dem2d_world_stress times its area.
/// Errors: STALE_ID.
DEM2D_API dem2d_result dem2d_world_particle_stress(const dem2d_world *world, dem2d_particle_id id,
                                                   dem2d_stress *stress);
/// Mean, deviator and direction of the symmetric part of a stress. Errors: NOT_FINITE.
DEM2D_API dem2d_result dem2d_stress_principal(const dem2d_stress *stress,
                                              dem2d_principal *principal);
/// Logarithmic strain -ln(now/before) of a length (m), compression positive; NaN unless both are
/// above 0 and finite. The same bits on every platform, with an error of 2 ulp, for small strains,
/// too.
DEM2D_API double dem2d_strain(double now, double before);
/// Coordination number, overlaps, solid area, rattlers.
DEM2D_API dem2d_result dem2d_world_packing(const dem2d_world *world, dem2d_packing *packing);
/// 1 - (area of particles inside a region)/(area of the region). The area of each particle has an
/// error of 1e-5, and none if the particle is a sharp polygon or completely inside; overlaps count
/// twice. Errors: NOT_FINITE, OUT_OF_RANGE (upper not above lower).
DEM2D_API dem2d_result dem2d_world_porosity(const dem2d_world *world, const dem2d_box *region,
                                            double *porosity);
/// Fabric: directions of contacts, and how branch lengths and forces depend on the direction.
DEM2D_API dem2d_result dem2d_world_fabric(const dem2d_world *world, dem2d_fabric *fabric);
/// A histogram with bins >= 1 equal parts; values gets one number for each bin, and means over
/// empty bins are 0. Errors: OUT_OF_RANGE, OUT_OF_MEMORY (it allocates room for the counts).
DEM2D_API dem2d_result dem2d_world_histogram(const dem2d_world *world, dem2d_histogram kind,
                                             int bins, double *values);
/// Speeds, kinetic energy and resultant forces, relative to energies and forces of the contacts.
DEM2D_API dem2d_result dem2d_world_equilibrium(const dem2d_world *world,
                                               dem2d_equilibrium *equilibrium);
/// Inertial number |strain_rate| d sqrt(density/pressure) with strain_rate in 1/s and pressure > 0
/// in Pa; d is the mean diameter of the circles of equal area, the density that of the solid.
/// Quasi-static below 1e-3; 0 without particles. Errors: NOT_FINITE, OUT_OF_RANGE.
DEM2D_API dem2d_result dem2d_world_inertial_number(const dem2d_world *world, double strain_rate,
                                                   double pressure, double *number);

/* ============================================================================================
   >>api-queries  What is where: overlaps, rays, the nearest; contacts of one particle
   ============================================================================================ */

/// What a query looks for; all zero, or NULL for the desc: everything.
typedef struct dem2d_query_desc {
    bool skip_particles; ///< look for walls only
    bool skip_walls;     ///< look for particles only
} dem2d_query_desc;

/// A particle or a wall that a query found.
typedef struct dem2d_found {
    dem2d_particle_id particle; ///< generation 0 when it is a wall
    dem2d_wall_id wall;         ///< generation 0 when it is a particle
    int part;                   ///< of the wall, by its number; 0 of a particle
} dem2d_found;

/// A point on a particle or a wall that a query found.
typedef struct dem2d_hit {
    dem2d_found found; ///< both generations 0: nothing was found, and all else is 0
    dem2d_vec point;   ///< m, on the surface; the start of a ray, or the point, if that is inside
    /// Unit, out of the surface, towards the start or the point. If the start of a ray is inside:
    /// against the ray. If the point is inside: 0.
    dem2d_vec normal;
    double distance; ///< m, from the start of the ray or from the point; 0 inside
} dem2d_hit;

/// Particles and walls that overlap a box: the first `capacity` of them go into found (may be NULL
/// if capacity is 0), first particles, then parts of walls, each sorted by index; count gets their
/// number.
///
/// All queries of this block are about the shapes where they are now, also before the first step.
/// Boundaries belong to the shapes, within rounding errors. The space behind a half-plane belongs
/// to it. The first query after something has moved makes a search tree over all particles and
/// segments, for which it may allocate; the others take a time that grows with what they find and
/// with the logarithm of the number of these. All half-planes are looked at. Results do not depend
/// on the order in memory. Errors: NULL_ARGUMENT, NOT_FINITE, OUT_OF_RANGE (upper below lower,
/// capacity below 0), OUT_OF_MEMORY.
DEM2D_API dem2d_result dem2d_world_query_box(dem2d_world *world, const dem2d_box *box,
                                             const dem2d_query_desc *desc, dem2d_found *found,
                                             int capacity, int *count);
/// The same for those that contain a point (m).
DEM2D_API dem2d_result dem2d_world_query_point(dem2d_world *world, dem2d_vec point,
                                               const dem2d_query_desc *desc, dem2d_found *found,
                                               int capacity, int *count);
/// The same for those that a shape at a pose overlaps, as dem2d_pair_overlap finds it. Errors: also
/// OUT_OF_RANGE (pose, sizes whose squares are not normal numbers).
DEM2D_API dem2d_result dem2d_world_query_shape(dem2d_world *world, const dem2d_shape *shape,
                                               dem2d_pose pose, const dem2d_query_desc *desc,
                                               dem2d_found *found, int capacity, int *count);
/// What a ray hits first, from an origin (m) along a direction (any length but 0) up to a length
/// (m, >= 0; 0: without end). Of several at the same distance the first in the order of
/// dem2d_world_query_box. A ray that begins in a shape hits it at distance 0. Circles, ellipses and
/// polygons have closed forms. For all other shapes a search encloses the hit between a tangent and
/// a chord, until these differ by 1e-12 of the radius at a right angle to the surface.
DEM2D_API dem2d_result dem2d_world_cast_ray(dem2d_world *world, dem2d_vec origin,
                                            dem2d_vec direction, double length,
                                            const dem2d_query_desc *desc, dem2d_hit *hit);
/// All that a ray hits, each where the ray enters it, sorted by distance: the first `capacity` of
/// them go into hits (may be NULL if capacity is 0); count gets the number of hits.
DEM2D_API dem2d_result dem2d_world_cast_ray_all(dem2d_world *world, dem2d_vec origin,
                                                dem2d_vec direction, double length,
                                                const dem2d_query_desc *desc, dem2d_hit *hits,
                                                int capacity, int *count);
/// The particle or wall nearest to a point (m) within a range (m, >= 0; 0: any), with an error of
/// 1e-10 of size and distance. Of several at the same distance the first in the order of
/// dem2d_world_query_box.
DEM2D_API dem2d_result dem2d_world_nearest(dem2d_world *world, dem2d_vec point, double range,
                                           const dem2d_query_desc *desc, dem2d_hit *hit);
/// Contacts of one particle in the last force pass, as dem2d_world_contacts describes them (the
/// particle is A or B), in the order in which their forces are summed, walls last: the first
/// `capacity` of them go into contacts (may be NULL if capacity is 0); count gets their number.
/// Errors: STALE_ID, OUT_OF_RANGE (capacity below 0).
DEM2D_API dem2d_result dem2d_world_particle_contacts(const dem2d_world *world, dem2d_particle_id id,
                                                     dem2d_contact_info *contacts, int capacity,
                                                     int *count);

/* ============================================================================================
   >>api-snapshot  State hash, snapshots
   ============================================================================================ */

/// Writes count bytes; returns false if it fails.
typedef bool dem2d_write_fn(void *user, const char *bytes, size_t count);
/// Reads the next count bytes; returns false if there are fewer.
typedef bool dem2d_read_fn(void *user, char *bytes, size_t count);
/// Finds the custom shape of a tag, or NULL. Only its support and user are used.
typedef const dem2d_custom_desc *dem2d_custom_fn(void *user, int tag);

/// Where a snapshot goes.
typedef struct dem2d_save_desc {
    dem2d_write_fn *write; ///< where the bytes go, or NULL when a path is given
    void *user;            ///< passed to write
} dem2d_save_desc;

/// Where a snapshot comes from, and the parts of a world that can't be saved.
typedef struct dem2d_load_desc {
    dem2d_read_fn *read;             ///< where the bytes come from, or NULL when a path is given
    void *user;                      ///< passed to read
    dem2d_parallel_fn *parallel_for; ///< of the world, as in dem2d_world_desc
    void *parallel_user;             ///< passed to parallel_for
    dem2d_custom_fn *custom;         ///< finds custom shapes; required when there are any
    void *custom_user;               ///< passed to custom
    dem2d_law_fn *law;               ///< of the world; required when it had one
    void *law_user;                  ///< passed to law
    int law_tag;                     ///< must be that of the world
    const dem2d_env *env;            ///< memory and log, copied; NULL for malloc, free, silence
    dem2d_gather_fn *gather;         ///< of the world, as in dem2d_world_desc
    dem2d_commit_fn *commit;         ///< likewise
    void *exchange_user;             ///< passed to gather and commit
    dem2d_loads_fn *loads;           ///< of the world, as in dem2d_world_desc
    void *loads_user;                ///< passed to loads
} dem2d_load_desc;

/// Hash of the state that the next step depends on: settings, steps, time, materials and their
/// pairs, templates, particles, walls, contacts and their springs. It takes them in the order of
/// ids and doubles by their bits (0 and -0 differ), so it is the same for any number of threads,
/// storage order, skin, compiler and machine. Not included: counters, the neighbour list,
/// callbacks, free ids, numbers that are 0: what later versions add changes no hash until it is
/// used. 0 for NULL.
DEM2D_API uint64_t dem2d_world_hash(const dem2d_world *world);
/// Write all of a world to desc->write, or to a file if path is not NULL (desc may then be NULL).
/// The file is written as path + ".part", then renamed: an old file is replaced only by a complete
/// one. The bytes are the same on any machine. Allocates only the file name. Errors: NULL_ARGUMENT,
/// OUT_OF_RANGE (both path and write), OUT_OF_MEMORY, IO.
DEM2D_API dem2d_result dem2d_world_save(const dem2d_world *world, const dem2d_save_desc *desc,
                                        const char *path);
/// Create the world of a snapshot. All ids stay valid, and its steps and statistics (except bytes)
/// have the same bits as those of the world that was saved. desc may be NULL (all zero, path is
/// then needed). read must have no byte after the snapshot. Temporary memory: at most one and a
/// half times the size of the snapshot. Errors: NULL_ARGUMENT (also a tag that custom does not
/// know, a missing law), OUT_OF_RANGE (both path and read), OUT_OF_MEMORY, IO, FORMAT,
/// FORMAT_VERSION.
DEM2D_API dem2d_result dem2d_world_load(const dem2d_load_desc *desc, const char *path,
                                        dem2d_world **world);

/* ============================================================================================
   >>api-writers  Pictures, files for ParaView, histories
   ============================================================================================ */

/// An SVG picture of a world.
typedef struct dem2d_svg_desc {
    double width;          ///< px, >= 0; 0 for 800; the height follows from the scene
    int outline_points;    ///< per curved particle, >= 3; 0 for 64
    bool force_chains;     ///< lines along branches, width by normal force
    dem2d_box view;        ///< m, the part that is drawn, upper above lower; all zero for the whole
                           ///< scene
    dem2d_write_fn *write; ///< where the bytes go, or NULL when a path is given
    void *user;            ///< passed to write
} dem2d_svg_desc;

/// What a .vtp file holds.
typedef enum dem2d_vtp_part {
    DEM2D_VTP_PARTICLES, ///< outlines
    DEM2D_VTP_CONTACTS,  ///< lines along the branches
    DEM2D_VTP_WALLS,     ///< lines, half-planes clipped by the scene's bounding box
    DEM2D_VTP_PART_COUNT
} dem2d_vtp_part;

/// A file of VTK's XML PolyData.
typedef struct dem2d_vtp_desc {
    int outline_points;    ///< per curved particle, >= 3; 0 for 64
    dem2d_vtp_part part;   ///< what is written
    dem2d_write_fn *write; ///< where the bytes go, or NULL when a path is given
    void *user;            ///< passed to write
} dem2d_vtp_desc;

/// A ParaView collection: files by time.
typedef struct dem2d_pvd_desc {
    int count;                ///< of files, 0 to 2^30
    const double *times;      ///< s, finite, one for each
    const char *const *files; ///< names as seen from the .pvd, in UTF-8, without control characters
    dem2d_write_fn *write;    ///< where the bytes go, or NULL when a path is given
    void *user;               ///< passed to write
} dem2d_pvd_desc;

/// A row of a history, as comma-separated values; with the columns of the ledger if there is one.
typedef struct dem2d_csv_desc {
    int count;                ///< of the caller's columns, 0 to 2^30
    const char *const *names; ///< of them, without commas, quotes and line ends
    const double *values;     ///< of them, finite
    bool append;              ///< one more row; else a header line and the first row, a new file
    dem2d_write_fn *write;    ///< where the bytes go, or NULL when a path is given
    void *user;               ///< passed to write
} dem2d_csv_desc;

/* Each writes either to desc->write or, if path is not NULL, to a file. None changes the world.
   Errors: NULL_ARGUMENT, OUT_OF_RANGE, NOT_FINITE, IO (the file can't be opened, written or closed,
   or write returns false). */

/// Draw shapes (a colour per model; fixed particles grey, driven ones hatched), walls, force chains
/// and, below, a scale bar. The whole scene is the box of particles and segments, with half-planes
/// whose distance from it is at most a third of its size. The line of the mean normal force is as
/// wide as a quarter of the mean radius, but at most 1/400 of the picture; no line is wider than
/// the radius of the smaller particle. desc may be NULL: all zero.
DEM2D_API dem2d_result dem2d_world_write_svg(const dem2d_world *world, const dem2d_svg_desc *desc,
                                             const char *path);
/// Write one part of a world for VTK and ParaView. Cell data of particles: id (index), type,
/// material, motion, contacts (walls not counted), velocity (mean of the half steps),
/// angular_velocity, angle, mass, radius (equivalent), stress (3 x 3); of contacts: a, b, wall
/// (indices, or -1), points, normal, force (on B), position, normal_force, tangential_force,
/// moment, depth; of walls: id, mode, velocity (mean of the half steps), force, stress. desc may be
/// NULL: all zero.
DEM2D_API dem2d_result dem2d_world_write_vtp(const dem2d_world *world, const dem2d_vtp_desc *desc,
                                             const char *path);
/// Write a collection of files that make a series in time. env (may be NULL) gets the messages.
DEM2D_API dem2d_result dem2d_pvd_write(const dem2d_env *env, const dem2d_pvd_desc *desc,
                                       const char *path);
/// Write a row: step, time (dem2d_stats), translational, rotational, normal, tangential, rolling,
/// potential (dem2d_energy), kinetic_ratio, mean_speed, max_speed, unbalanced (dem2d_equilibrium),
/// coordination, coordination_loaded, rattlers (dem2d_packing), contacts, wall_contacts,
/// max_overlap, then the caller's columns. desc may be NULL: all zero.
DEM2D_API dem2d_result dem2d_world_write_csv(const dem2d_world *world, const dem2d_csv_desc *desc,
                                             const char *path);

#ifdef __cplusplus
}
#endif

/* Stop here if you only use the library: below is how it works. */

#endif /* DEM2D_H */

#ifdef DEM2D_IMPLEMENTATION
#ifndef DEM2D_IMPLEMENTATION_ONCE
#define DEM2D_IMPLEMENTATION_ONCE

/* ============================================================================================
   >>config  Requirements on the compiler, constants, exact floating point
   uses: nothing
   ============================================================================================ */

#if defined(__FAST_MATH__)
#error "dem2d.h: -ffast-math removes NaN checks and reorders sums; compile without it"
#elif defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0
#error "dem2d.h: -ffinite-math-only removes NaN checks; compile without it"
#elif defined(__ASSOCIATIVE_MATH__)
#error "dem2d.h: -fassociative-math reorders sums; compile without it"
#elif defined(__RECIPROCAL_MATH__)
#error "dem2d.h: -freciprocal-math rounds quotients twice; compile without it"
#endif

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD == 2
#error "dem2d.h: 80-bit arithmetic; on 32-bit x86 compile with -msse2 -mfpmath=sse"
#endif

/* a * b + c must be two rounded operations everywhere, or runs differ between compilers. In spite
   of fp-contract=off, gcc 12 fuses a * b +- c in its basic-block vectoriser. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off", "no-tree-slp-vectorize")
#endif

#if defined(__GNUC__)
#define DEM2DI_PRINTF(text, first) __attribute__((format(printf, text, first)))
#else
#define DEM2DI_PRINTF(text, first)
#endif

/* For loops that are written once and compiled for several sets of features. */
#if defined(__GNUC__)
#define DEM2DI_INLINE inline __attribute__((always_inline))
#else
#define DEM2DI_INLINE inline
#endif

/* Around loops that are to use vector instructions: gcc 12 does not vectorise them at -O2. */
#if defined(__GNUC__) && !defined(__clang__)
#define DEM2DI_VECTORS_BEGIN    \
    _Pragma("GCC push_options") \
        _Pragma("GCC optimize(\"tree-loop-vectorize\", \"vect-cost-model=dynamic\")")
#define DEM2DI_VECTORS_END _Pragma("GCC pop_options")
#else
#define DEM2DI_VECTORS_BEGIN
#define DEM2DI_VECTORS_END
#endif

/* Load memory into the cache that is needed soon; an
 * address past the array's end does no harm. */
#if defined(__GNUC__)
#define DEM2DI_PREFETCH(array, ahead) \
    __builtin_prefetch((const void *)((uintptr_t)(array) + (ahead) * sizeof *(array)))
#else
#define DEM2DI_PREFETCH(array, ahead) ((void)0)
#endif

#define DEM2DI_PI 3.14159265358979323846

/* Rounding error of a support value of A minus B, in units of R_A + R_B + |d|: two rotations, two
   support functions and two subtractions of about eps each are below 8 eps; this is twice that. */
#define DEM2DI_ROUNDOFF (16 * DBL_EPSILON)

#ifdef __cplusplus
extern "C" {
#endif

/* ============================================================================================
   >>math  Vectors, rotations, and sine, cosine and arctangent with the same bits everywhere
   uses: config
   ============================================================================================ */

static dem2d_vec dem2di_vec(double x, double y) {
    dem2d_vec v;
    v.x = x;
    v.y = y;
    return v;
}

static dem2d_vec dem2di_add(dem2d_vec a, dem2d_vec b) {
    return dem2di_vec(a.x + b.x, a.y + b.y);
}

static dem2d_vec dem2di_sub(dem2d_vec a, dem2d_vec b) {
    return dem2di_vec(a.x - b.x, a.y - b.y);
}

static dem2d_vec dem2di_scale(dem2d_vec a, double f) {
    return dem2di_vec(a.x * f, a.y * f);
}

static dem2d_vec dem2di_negate(dem2d_vec a) {
    return dem2di_vec(-a.x, -a.y);
}

/* a + f b */
static dem2d_vec dem2di_along(dem2d_vec a, double f, dem2d_vec b) {
    return dem2di_vec(a.x + f * b.x, a.y + f * b.y);
}

static double dem2di_dot(dem2d_vec a, dem2d_vec b) {
    return a.x * b.x + a.y * b.y;
}

static double dem2di_cross(dem2d_vec a, dem2d_vec b) {
    return a.x * b.y - a.y * b.x;
}

/* A quarter turn counter-clockwise. */
static dem2d_vec dem2di_perp(dem2d_vec a) {
    return dem2di_vec(-a.y, a.x);
}

/* A quarter turn clockwise: from a tangent to the outward normal. */
static dem2d_vec dem2di_right(dem2d_vec a) {
    return dem2di_vec(a.y, -a.x);
}

static double dem2di_length(dem2d_vec a) {
    return sqrt(dem2di_dot(a, a));
}

/* If a is NaN the result is b; if b is NaN it is NaN. */
static double dem2di_max(double a, double b) {
    return a > b ? a : b;
}

static double dem2di_min(double a, double b) {
    return a < b ? a : b;
}

static bool dem2di_finite(double a) {
    return a - a == 0;
}

static bool dem2di_vec_finite(dem2d_vec a) {
    return dem2di_finite(a.x) && dem2di_finite(a.y);
}

/* v / |v| for any finite v but 0, without intermediate overflow or underflow; else false. */
static bool dem2di_unit(dem2d_vec v, dem2d_vec *unit) {
    double square = dem2di_dot(v, v);
    if (square > 1e-280 && square < 1e280) {
        double length = sqrt(square);
        *unit = dem2di_vec(v.x / length, v.y / length);
        return true;
    }
    double largest = dem2di_max(fabs(v.x), fabs(v.y));
    if (!dem2di_vec_finite(v) || !(largest > 0)) return false;
    v = dem2di_vec(v.x / largest, v.y / largest);
    double length = dem2di_length(v);
    *unit = dem2di_vec(v.x / length, v.y / length);
    return true;
}

static dem2d_vec dem2di_turn(dem2d_rot q, dem2d_vec v) {
    return dem2di_vec(q.c * v.x - q.s * v.y, q.s * v.x + q.c * v.y);
}

static dem2d_vec dem2di_turn_back(dem2d_rot q, dem2d_vec v) {
    return dem2di_vec(q.c * v.x + q.s * v.y, q.c * v.y - q.s * v.x);
}

static dem2d_rot dem2di_rot(dem2d_vec v) {
    dem2d_rot q;
    q.c = v.x;
    q.s = v.y;
    return q;
}

/* Sine and cosine for |x| <= pi/4 by their Taylor series; the first omitted terms are
   (pi/4)^19/19! = 8e-20 and (pi/4)^20/20! = 3e-21. */
static dem2d_rot dem2di_small_rot(double x) {
    double y = x * x, sine = 1, cosine = 1;
    dem2d_rot q;
    for (int n = 17; n > 1; n -= 2) {
        sine = 1 - y / ((n - 1) * n) * sine;
        cosine = 1 - y / (n * (n + 1)) * cosine;
    }
    q.s = x * sine;
    q.c = 1 - y / 2 * cosine;
    return q;
}

DEM2D_API dem2d_rot dem2d_rot_make(double angle) {
    /* pi/2 in three parts of 22 bits and a remainder: k times a part is exact for k < 2^31. */
    static const double part[4] = {1.570796012878418, 3.139164164167596e-07, 6.223371969669989e-14,
                                   2.0222662487959506e-21};
    double k = floor(angle * (2 / DEM2DI_PI) + 0.5), x = angle;
    dem2d_rot q, turned;
    if (!(fabs(angle) <= 1073741824.0)) {
        q.c = q.s = (double)NAN;
        return q;
    }
    for (int i = 0; i < 4; i++) x -= k * part[i];
    q = turned = dem2di_small_rot(x);
    int quadrant = (int)(k - 4 * floor(k / 4));
    if (quadrant == 1) turned.c = -q.s, turned.s = q.c;
    if (quadrant == 2) turned.c = -q.c, turned.s = -q.s;
    if (quadrant == 3) turned.c = q.s, turned.s = -q.c;
    return turned;
}

DEM2D_API double dem2d_rot_angle(dem2d_rot rotation) {
    dem2d_vec v;
    if (!dem2di_unit(dem2di_vec(rotation.c, rotation.s), &v)) return 0;
    double x = fabs(v.x), y = fabs(v.y), t = x > y ? y / x : x / y;
    /* atan t = t (pi/4 + 0.273 (1 - t)) to 0.004. A correction by asin d = d + d^3/6 + ... has an
       error of 3 d^5/40: 7e-14 after the first, below rounding errors after the second. */
    double angle = t * (DEM2DI_PI / 4 + 0.273 * (1 - t));
    if (y >= x) angle = DEM2DI_PI / 2 - angle;
    if (v.x < 0) angle = DEM2DI_PI - angle;
    if (v.y < 0) angle = -angle;
    for (int i = 0; i < 2; i++) {
        dem2d_rot q = dem2d_rot_make(angle);
        double d = v.y * q.c - v.x * q.s;
        angle += d + d * d * d / 6;
    }
    return angle > -DEM2DI_PI ? angle : DEM2DI_PI;
}

/* Angle from a to b in (-pi, pi]. */
static double dem2di_angle(dem2d_vec a, dem2d_vec b) {
    return dem2d_rot_angle(dem2di_rot(dem2di_vec(dem2di_dot(a, b), dem2di_cross(a, b))));
}

/* Direction i of count uniform ones. */
static dem2d_vec dem2di_direction(int i, int count) {
    dem2d_rot z = dem2d_rot_make(2 * DEM2DI_PI * i / count);
    return dem2di_vec(z.c, z.s);
}

/* ln(a/b) for a >= b > 0 = k ln 2 + 2 artanh z, z = (a - b)/(a + b). Exact halving and doubling
   bring b to between 0.7 a and 1.4 a, so that z^2 <= 1/34. Then a - b is exact, and the first
   omitted term, z^24/25, is 1e-38. */
static double dem2di_log_ratio(double a, double b) {
    /* ln 2 in two parts, the first of 32 bits: k times it is exact */
    const double high = 6.93147180369123816490e-01, low = 1.90821492927058770002e-10;
    int k = 0;
    for (; b < a * 0.70710678118654752; k++)
        if (a > 1)
            a /= 2;
        else
            b *= 2;
    if (a > 1) a /= 2, b /= 2; /* so that a + b does not overflow */
    double z = (a - b) / (a + b), square = z * z, sum = 0;
    for (int n = 23; n > 1; n -= 2) sum = square * (sum + 1.0 / n);
    return k * high + (2 * z + (2 * z * sum + k * low));
}

DEM2D_API dem2d_pose dem2d_pose_make(double x, double y, double angle, double scale) {
    dem2d_pose pose;
    pose.position = dem2di_vec(x, y);
    pose.rotation = dem2d_rot_make(angle);
    pose.scale = scale;
    return pose;
}

/* Extend a box to a point. */
static void dem2di_box_add(dem2d_box *box, dem2d_vec p) {
    box->lower = dem2di_vec(dem2di_min(box->lower.x, p.x), dem2di_min(box->lower.y, p.y));
    box->upper = dem2di_vec(dem2di_max(box->upper.x, p.x), dem2di_max(box->upper.y, p.y));
}

/* The bounding box of points; its upper corner relative to the lower one is *size. */
static dem2d_box dem2di_box_of(const dem2d_vec *points, int count, dem2d_vec *size) {
    dem2d_box box = {points[0], points[0]};
    for (int i = 1; i < count; i++) dem2di_box_add(&box, points[i]);
    *size = dem2di_sub(box.upper, box.lower);
    return box;
}

/* A symmetric tensor in the plane. */
typedef struct dem2di_tensor {
    double xx, xy, yy;
} dem2di_tensor;

/* t += f (a b + b a)/2 */
static void dem2di_tensor_add(dem2di_tensor *t, double f, dem2d_vec a, dem2d_vec b) {
    t->xx += f * (a.x * b.x);
    t->xy += f * ((a.x * b.y + a.y * b.x) / 2);
    t->yy += f * (a.y * b.y);
}

/* Mohr's circle. */
static dem2d_principal dem2di_tensor_principal(dem2di_tensor t) {
    dem2d_vec across = dem2di_vec(t.xx / 2 - t.yy / 2, t.xy), u = {0, 0};
    (void)dem2di_unit(across, &u);
    dem2d_principal principal;
    principal.p = t.xx / 2 + t.yy / 2;
    principal.q = dem2di_dot(across, u);
    principal.angle = dem2d_rot_angle(dem2di_rot(u)) / 2;
    return principal;
}

/* ============================================================================================
   >>memory  Allocation by the environment, results and the log
   uses: config
   ============================================================================================ */

DEM2D_API int dem2d_version(void) {
    return DEM2D_VERSION;
}

DEM2D_API const char *dem2d_result_text(dem2d_result result) {
    static const char *const text[] = {
#define DEM2DI_RESULT_TEXT(name, text) text,
        DEM2D_RESULTS(DEM2DI_RESULT_TEXT)
#undef DEM2DI_RESULT_TEXT
    };
    bool known = (int)result >= 0 && (int)result < (int)DEM2D_RESULT_COUNT;
    return known ? text[result] : "unknown result";
}

/* Write the details of an error to the log, and return the result. */
DEM2DI_PRINTF(4, 5)
static dem2d_result dem2di_fail(const dem2d_env *env, dem2d_result result, int index,
                                const char *format, ...) {
    char text[256];
    if (env != NULL && env->log != NULL) {
        va_list arguments;
        va_start(arguments, format);
        (void)vsnprintf(text, sizeof text, format, arguments);
        va_end(arguments);
        env->log(env->user, result, index, text);
    }
    return result;
}

static dem2d_result dem2di_fail_null(const dem2d_env *env, const char *name) {
    return dem2di_fail(env, DEM2D_NULL_ARGUMENT, -1, "%s is NULL", name);
}

static dem2d_result dem2di_fail_memory(const dem2d_env *env, int count, const char *what) {
    return dem2di_fail(env, DEM2D_OUT_OF_MEMORY, -1, "no memory for %d %s", count, what);
}

/* Only both callbacks together replace malloc and free. */
static bool dem2di_env_allocates(const dem2d_env *env) {
    return env != NULL && env->allocate != NULL && env->release != NULL;
}

/* Memory for count elements of a size; NULL if there is none or the product overflows. */
static void *dem2di_allocate(const dem2d_env *env, size_t count, size_t size) {
    if (count == 0 || size > (size_t)PTRDIFF_MAX / count) return NULL;
    if (dem2di_env_allocates(env)) return env->allocate(env->user, count * size);
    return malloc(count * size);
}

static void dem2di_release(const dem2d_env *env, void *memory, size_t count, size_t size) {
    if (memory == NULL) return;
    if (dem2di_env_allocates(env))
        env->release(env->user, memory, count * size);
    else
        free(memory);
}

/* A new capacity for at least `needed` elements: it grows by half, for arrays that grow one by
   one. */
static int dem2di_growth(int capacity, int needed) {
    int grown = capacity < INT_MAX / 2 ? capacity + capacity / 2 : INT_MAX;
    return needed <= capacity ? capacity : grown < needed ? needed : grown;
}

/* A copy of an array with room for more elements, which are all zero; NULL without memory. */
static void *dem2di_lengthened(const dem2d_env *env, const void *array, size_t size, int old,
                               int grown) {
    size_t used = (size_t)old * size, more = (size_t)(grown - old) * size;
    void *made = dem2di_allocate(env, (size_t)grown, size);
    if (made == NULL) return NULL;
    if (used > 0) memcpy(made, array, used);
    memset((char *)made + used, 0, more);
    return made;
}

static bool dem2di_reserve(const dem2d_env *env, void **array, int *capacity, int needed,
                           size_t size) {
    int grown = dem2di_growth(*capacity, needed);
    if (grown == *capacity) return true;
    void *made = dem2di_lengthened(env, *array, size, *capacity, grown);
    if (made == NULL) return false;
    dem2di_release(env, *array, (size_t)*capacity, size);
    *array = made;
    *capacity = grown;
    return true;
}

/* The next of several arrays in one block of memory, those of the largest types first; NULL if it
   has no elements. */
static void *dem2di_next_array(char **next, size_t count, size_t size) {
    char *array = *next;
    *next += count * size;
    return count > 0 ? array : NULL;
}

/* ============================================================================================
   >>fields  Fields of structs as data: name, place, type, range; one check for all of them
   uses: config, math, memory

   Each desc has a table with a row for each field, in their order. One function checks a desc by
   its table; rules between fields are code beside the table. To add a field, declare it in the
   struct with its comment and give it a row: tests/test_header.c then compares the unit, default
   and range of both, and tests/test_misuse.c tries what is out of the range.
   ============================================================================================ */

/* Both components of a vector are in the range. Any value is right for the last three. */
typedef enum dem2di_type {
    DEM2DI_DOUBLE,
    DEM2DI_VEC,
    DEM2DI_INT,
    DEM2DI_ENUM,
    DEM2DI_POINTER, /* as a number 1, NULL 0 */
    DEM2DI_BOOL,
    DEM2DI_ID,
    DEM2DI_UINT64,
    DEM2DI_INT64 /* in snapshots only */
} dem2di_type;

/* Without low; without high; 0 as well; any number, also one that is not finite. */
enum { DEM2DI_ABOVE = 1, DEM2DI_BELOW = 2, DEM2DI_OR_0 = 4, DEM2DI_ANY = 8 };

typedef struct dem2di_field {
    const char *name; /* in a struct inside: "view.lower" */
    double low, high; /* DBL_MAX: no bound */
    uint8_t flags, type, size;
    uint16_t offset;
#ifdef DEM2DI_FIELD_TEXTS
    const char *text; /* "unit default; note", for the test of the struct's comments */
#endif
} dem2di_field;

#ifdef DEM2DI_FIELD_TEXTS
#define DEM2DI_FIELD_TEXT(text) , text
#else
#define DEM2DI_FIELD_TEXT(text)
#endif
#define DEM2DI_ROW(of, field, range, text) \
    { #field, range, sizeof(((of *)0)->field), offsetof(of, field) DEM2DI_FIELD_TEXT(text) }
#define DEM2DI_ALL(fields) fields, (int)(sizeof(fields) / sizeof *(fields))

/* Ranges: low, high, flags, type. */
#define DEM2DI_NUMBER(low, high, flags) low, high, flags, DEM2DI_DOUBLE
#define DEM2DI_FINITE DEM2DI_NUMBER(-DBL_MAX, DBL_MAX, 0)
#define DEM2DI_POSITIVE DEM2DI_NUMBER(0, DBL_MAX, DEM2DI_ABOVE)
#define DEM2DI_FROM_0 DEM2DI_NUMBER(0, DBL_MAX, 0)
#define DEM2DI_FRACTION DEM2DI_NUMBER(0, 1, DEM2DI_BELOW)
#define DEM2DI_VECTOR -DBL_MAX, DBL_MAX, 0, DEM2DI_VEC
#define DEM2DI_WHOLE(low, high) low, high, 0, DEM2DI_INT
#define DEM2DI_WHOLE_OR_0(low, high) low, high, DEM2DI_OR_0, DEM2DI_INT
#define DEM2DI_COUNT DEM2DI_WHOLE(0, DBL_MAX)
#define DEM2DI_TAG DEM2DI_WHOLE(-DBL_MAX, DBL_MAX)
#define DEM2DI_CHOICE(count) 0, (int)(count)-1, 0, DEM2DI_ENUM
#define DEM2DI_REQUIRED 1, 1, 0, DEM2DI_POINTER
#define DEM2DI_OPTIONAL 0, 1, 0, DEM2DI_POINTER
#define DEM2DI_SWITCH 0, 0, 0, DEM2DI_BOOL
#define DEM2DI_HANDLE 0, 0, 0, DEM2DI_ID
#define DEM2DI_WORD 0, 0, 0, DEM2DI_UINT64
#define DEM2DI_COUNTER 0, 4611686018427387904.0, 0, DEM2DI_INT64 /* 2^62: a sum may be made */
#define DEM2DI_ANY_NUMBER 0, 0, DEM2DI_ANY, DEM2DI_DOUBLE
#define DEM2DI_MAY_OVERFLOW DEM2DI_NUMBER(0, HUGE_VAL, 0)

/* The number at a place; 0 for what has no range. Where enums are short they take one byte. */
static DEM2DI_INLINE double dem2di_number_at(const char *at, int type, size_t size) {
    static const char null[2 * sizeof(void *)] = {0};
    double number;
    int whole;
    if (type == DEM2DI_DOUBLE || type == DEM2DI_VEC)
        return (memcpy(&number, at, sizeof number), number);
    if (type == DEM2DI_POINTER) return memcmp(at, null, size) != 0;
    if (type != DEM2DI_INT && type != DEM2DI_ENUM) return 0;
    if (size < sizeof whole) return *(const unsigned char *)at;
    return (memcpy(&whole, at, sizeof whole), whole);
}

/* What is not finite is in no range but ANY. */
static DEM2DI_INLINE bool dem2di_within(double value, double low, double high, int flags) {
    if ((flags & DEM2DI_ANY) != 0 || ((flags & DEM2DI_OR_0) != 0 && value == 0)) return true;
    return ((flags & DEM2DI_ABOVE) != 0 ? value > low : value >= low) &&
           ((flags & DEM2DI_BELOW) != 0 ? value < high : value <= high);
}

static bool dem2di_in_range(const dem2di_field *field, double value) {
    return dem2di_within(value, field->low, field->high, field->flags);
}

/* Is a field in its range? With constants this is a comparison or two, without a table. */
static DEM2DI_INLINE bool dem2di_is_good(const void *field, size_t size, double low, double high,
                                         int flags, int type) {
    const char *at = (const char *)field;
    return dem2di_within(dem2di_number_at(at, type, size), low, high, flags) &&
           (type != DEM2DI_VEC ||
            dem2di_within(dem2di_number_at(at + size / 2, type, size), low, high, flags));
}

/* A range as text: "> 0", "in [0, 1)", "0 or 2 to 256". */
static void dem2di_range_text(const dem2di_field *field, char text[64]) {
    bool above = (field->flags & DEM2DI_ABOVE) != 0, below = (field->flags & DEM2DI_BELOW) != 0;
    const char *zero = (field->flags & DEM2DI_OR_0) != 0 ? "0 or " : "";
    if (field->high == DBL_MAX)
        (void)snprintf(text, 64, "%s%s %.10g", zero, above ? ">" : ">=", field->low);
    else if (above || below)
        (void)snprintf(text, 64, "%sin %c%.10g, %.10g%c", zero, above ? '(' : '[', field->low,
                       field->high, below ? ')' : ']');
    else
        (void)snprintf(text, 64, "%s%.10g to %.10g", zero, field->low, field->high);
}

/* A value that is out of its range. */
static dem2d_result dem2di_fail_value(const dem2d_env *env, const dem2di_field *field,
                                      double value) {
    char range[64];
    if (field->type == DEM2DI_POINTER) return dem2di_fail_null(env, field->name);
    if (!dem2di_finite(value))
        return dem2di_fail(env, DEM2D_NOT_FINITE, -1, "%s = %g is not finite", field->name, value);
    if (env == NULL) return DEM2D_OUT_OF_RANGE;
    dem2di_range_text(field, range);
    return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "%s = %.10g is not %s", field->name, value,
                       range);
}

/* The error names the first field that is out of its range. */
static dem2d_result dem2di_check_fields(const dem2d_env *env, const dem2di_field *fields, int count,
                                        const void *of) {
    for (int i = 0; i < count; i++)
        for (int k = 0; k <= (fields[i].type == DEM2DI_VEC); k++) {
            const char *at = (const char *)of + fields[i].offset + k * (int)sizeof(double);
            double value = dem2di_number_at(at, fields[i].type, fields[i].size);
            if (!dem2di_in_range(&fields[i], value))
                return dem2di_fail_value(env, &fields[i], value);
        }
    return DEM2D_OK;
}

/* A value for the field at this offset alone. */
static dem2d_result dem2di_check_one(const dem2d_env *env, const dem2di_field *fields,
                                     size_t offset, const void *value) {
    while (fields->offset != offset) fields++;
    dem2di_field field = *fields;
    field.offset = 0;
    return dem2di_check_fields(env, &field, 1, value);
}

/* A number that is no field, or whose range follows from other fields: the last four. */
static dem2d_result dem2di_check_number(const dem2d_env *env, const char *name, double value,
                                        double low, double high, int flags, int type) {
    dem2di_field field;
    memset(&field, 0, sizeof field);
    field.name = name;
    field.low = low;
    field.high = high;
    field.flags = (uint8_t)flags;
    field.type = (uint8_t)type;
    return dem2di_in_range(&field, value) ? DEM2D_OK : dem2di_fail_value(env, &field, value);
}

static dem2d_result dem2di_check_vec(const dem2d_env *env, const char *name, dem2d_vec value) {
    dem2d_result result = dem2di_check_number(env, name, value.x, DEM2DI_FINITE);
    return result == DEM2D_OK ? dem2di_check_number(env, name, value.y, DEM2DI_FINITE) : result;
}

/* Points of a caller: not NULL, at least `least` of them, finite. */
static dem2d_result dem2di_check_points(const dem2d_env *env, const char *name,
                                        const dem2d_vec *points, int count, int least) {
    if (points == NULL) return dem2di_fail_null(env, name);
    if (count < least)
        return dem2di_fail(env, DEM2D_TOO_FEW_POINTS, -1, "%s: %d given, %d needed", name, count,
                           least);
    for (int i = 0; i < count; i++)
        if (!dem2di_vec_finite(points[i]))
            return dem2di_fail(env, DEM2D_NOT_FINITE, i, "%s[%d] = (%g, %g) is not finite", name, i,
                               points[i].x, points[i].y);
    return DEM2D_OK;
}

/* ============================================================================================
   >>hull  Convex hulls and the checks of convex polygons
   uses: config, math, memory, fields
   ============================================================================================ */

static int dem2di_compare_points(const void *a, const void *b) {
    const dem2d_vec *p = (const dem2d_vec *)a, *q = (const dem2d_vec *)b;
    if (p->x != q->x) return p->x < q->x ? -1 : 1;
    return (p->y > q->y) - (p->y < q->y);
}

/* Rounding error of the cross product of two edges whose ends have coordinates up to `size`: each
   component of an edge has an error of eps size. */
static double dem2di_cross_roundoff(double size, dem2d_vec a, dem2d_vec b) {
    return 4 * DBL_EPSILON * size * (dem2di_length(a) + dem2di_length(b));
}

static double dem2di_coordinate_size(const dem2d_vec *points, int count) {
    double size = 0;
    for (int i = 0; i < count; i++)
        size = dem2di_max(size, dem2di_max(fabs(points[i].x), fabs(points[i].y)));
    return size;
}

/* Andrew's monotone chain: from sorted points to the hull, counter-clockwise. chain has room for
   count + 1 points. */
static int dem2di_monotone_chain(const dem2d_vec *sorted, int count, dem2d_vec *chain) {
    double size = dem2di_coordinate_size(sorted, count);
    int length = 0;
    for (int pass = 0; pass < 2; pass++) {
        int base = length;
        for (int k = 0; k < count; k++) {
            dem2d_vec p = sorted[pass == 0 ? k : count - 1 - k];
            while (length >= base + 2) {
                dem2d_vec a = dem2di_sub(chain[length - 1], chain[length - 2]);
                dem2d_vec b = dem2di_sub(p, chain[length - 1]);
                if (dem2di_cross(a, b) > dem2di_cross_roundoff(size, a, b)) break;
                length--;
            }
            chain[length++] = p;
        }
        length--; /* the last point is the first one of the other half */
    }
    return length;
}

DEM2D_API dem2d_result dem2d_polygon_hull(const dem2d_env *env, const dem2d_vec *points, int count,
                                          dem2d_vec *hull, int *hull_count) {
    dem2d_result result = dem2di_check_points(env, "points", points, count, 3);
    if (result != DEM2D_OK) return result;
    if (hull == NULL || hull_count == NULL) return dem2di_fail_null(env, "hull");
    size_t room = 2 * (size_t)count + 2; /* sorted copy, and a chain of count + 1 */
    dem2d_vec *sorted = (dem2d_vec *)dem2di_allocate(env, room, sizeof *sorted);
    if (sorted == NULL) return dem2di_fail_memory(env, count, "points of a hull");
    dem2d_vec *chain = sorted + count;
    memcpy(sorted, points, (size_t)count * sizeof *sorted);
    qsort(sorted, (size_t)count, sizeof *sorted, dem2di_compare_points);
    int length = dem2di_monotone_chain(sorted, count, chain);
    if (length < 3) {
        result = dem2di_fail(env, DEM2D_ZERO_AREA, -1, "all points are on one line");
    } else {
        memcpy(hull, chain, (size_t)length * sizeof *hull);
        *hull_count = length;
    }
    dem2di_release(env, sorted, room, sizeof *sorted);
    return result;
}

/* Twice the signed area, about the first point. */
static double dem2di_twice_area(const dem2d_vec *points, int count) {
    double sum = 0;
    for (int i = 1; i + 1 < count; i++)
        sum += dem2di_cross(dem2di_sub(points[i], points[0]), dem2di_sub(points[i + 1], points[0]));
    return sum;
}

static void dem2di_reverse(dem2d_vec *points, int count) {
    for (int i = 0, j = count - 1; i < j; i++, j--) {
        dem2d_vec p = points[i];
        points[i] = points[j];
        points[j] = p;
    }
}

/* Is the angle of a direction in [0, pi)? */
static bool dem2di_upper(dem2d_vec e) {
    return e.y > 0 || (e.y == 0 && e.x > 0);
}

/* One pass: keep the corners that turn left, drop those that are straight within rounding errors.
   index[] has their indices in the caller's array. A right turn gives DEM2D_NOT_CONVEX, and *bad is
   its index. */
static dem2d_result dem2di_keep_corners(dem2d_vec *points, int *index, int *count, int *bad) {
    int kept = 0, n = *count;
    double size = dem2di_coordinate_size(points, n);
    dem2d_vec first = points[0], before = points[n - 1];
    for (int i = 0; i < n; i++) {
        dem2d_vec here = points[i], after = i + 1 < n ? points[i + 1] : first;
        dem2d_vec a = dem2di_sub(here, before), b = dem2di_sub(after, here);
        double turn = dem2di_cross(a, b), roundoff = dem2di_cross_roundoff(size, a, b);
        before = here;
        *bad = index[i];
        if (turn < -roundoff) return DEM2D_NOT_CONVEX;
        if (turn <= roundoff && dem2di_dot(a, b) < 0) return DEM2D_NOT_CONVEX;
        if (turn <= roundoff) continue;
        points[kept] = here;
        index[kept++] = index[i];
    }
    *count = kept;
    return DEM2D_OK;
}

/* A closed convex chain turns once if its edge directions enter the upper half-plane once. */
static bool dem2di_turns_once(const dem2d_vec *points, int count) {
    int entries = 0;
    dem2d_vec edge = dem2di_sub(points[0], points[count - 1]);
    for (int i = 0; i < count; i++) {
        dem2d_vec next = dem2di_sub(points[(i + 1) % count], points[i]);
        if (!dem2di_upper(edge) && dem2di_upper(next)) entries++;
        edge = next;
    }
    return entries == 1;
}

/* Turn count points into a counter-clockwise strictly convex polygon; an error names the point. */
static dem2d_result dem2di_clean_polygon(const dem2d_env *env, dem2d_vec *points, int *index,
                                         int *count) {
    int n = *count, bad = 0;
    double size = dem2di_coordinate_size(points, n), extent = 0;
    for (int i = 0; i < n; i++)
        extent = dem2di_max(extent, dem2di_length(dem2di_sub(points[i], points[0])));
    for (int i = 0; i < n; i++) {
        index[i] = i;
        double edge = dem2di_length(dem2di_sub(points[(i + 1) % n], points[i]));
        if (edge <= 4 * DBL_EPSILON * size)
            return dem2di_fail(env, DEM2D_DUPLICATE_POINT, i,
                               "points[%d] and the next point coincide", i);
    }
    double area = dem2di_twice_area(points, n);
    if (fabs(area) <= 8 * DBL_EPSILON * size * extent)
        return dem2di_fail(env, DEM2D_ZERO_AREA, -1, "twice the polygon's area is %g", area);
    if (area < 0) {
        dem2di_reverse(points, n);
        for (int i = 0; i < n; i++) index[i] = n - 1 - i;
    }
    do {
        n = *count;
        if (dem2di_keep_corners(points, index, count, &bad) != DEM2D_OK)
            return dem2di_fail(env, DEM2D_NOT_CONVEX, bad, "points[%d] is not a convex corner",
                               bad);
    } while (*count < n && *count >= 3);
    if (*count < 3) return dem2di_fail(env, DEM2D_ZERO_AREA, -1, "all points are on one line");
    if (!dem2di_turns_once(points, *count))
        return dem2di_fail(env, DEM2D_NOT_CONVEX, -1,
                           "the polygon winds around its points more than once");
    return DEM2D_OK;
}

/* ============================================================================================
   >>series  Trigonometric polynomials: values and rigorous bounds of their minimum
   uses: config, math
   ============================================================================================ */

/* The sum of weight(n) (a[n] cos nt + b[n] sin nt). The weight is 1 for p and 1 - n^2 for the
   radius of curvature rho = p + p'', times a sign. */
typedef struct dem2di_series {
    const double *a, *b; /* order + 1 each; a[0]/2 is the mean, b[0] is not used */
    int order;
    bool radius;   /* radius of curvature: weight 1 - n^2 */
    double sign;   /* +1 or -1 */
    double fourth; /* bound of the fourth derivative: sum n^4 |c_n| |weight| */
    double size;   /* bound of the value: sum |c_n| |weight| */
} dem2di_series;

static double dem2di_series_weight(const dem2di_series *s, int n) {
    return s->radius ? s->sign * (1 - (double)n * n) : s->sign;
}

static dem2di_series dem2di_series_make(const double *a, const double *b, int order, bool radius,
                                        double sign) {
    dem2di_series s;
    s.a = a;
    s.b = b;
    s.order = order;
    s.radius = radius;
    s.sign = sign;
    s.fourth = 0;
    s.size = fabs(a[0]) / 2;
    for (int n = 1; n <= order; n++) {
        double term = dem2di_length(dem2di_vec(a[n], b[n])) * fabs(dem2di_series_weight(&s, n));
        s.size += term;
        s.fourth += term * n * n * n * n;
    }
    return s;
}

/* Value and three derivatives at an angle, by repeated rotation: term n has an error of n eps. */
static double dem2di_series_value(const dem2di_series *s, double t, double d[3]) {
    dem2d_rot z = dem2d_rot_make(t);
    dem2d_vec power = dem2di_vec(z.c, z.s);
    double value = s->sign * s->a[0] / 2;
    d[0] = d[1] = d[2] = 0;
    for (int n = 1; n <= s->order; n++) {
        double weight = dem2di_series_weight(s, n), square = (double)n * n;
        double even = weight * (s->a[n] * power.x + s->b[n] * power.y);
        double odd = weight * n * (s->b[n] * power.x - s->a[n] * power.y);
        value += even;
        d[0] += odd;
        d[1] -= square * even;
        d[2] -= square * odd;
        power = dem2di_turn(z, power);
    }
    return value;
}

typedef struct dem2di_bounds {
    double lower, upper; /* of a minimum: a proved lower bound, an attained value */
} dem2di_bounds;

/* Lower bound on an interval of half width w, by Taylor's formula: the least value of the parabola
   minus the greatest absolute values of the cubic term and the remainder. */
static double dem2di_taylor_bound(const dem2di_series *s, double value, const double d[3],
                                  double w) {
    double slope = fabs(d[0]), parabola = value - slope * w + d[1] * w * w / 2;
    if (d[1] > 0 && slope < d[1] * w) parabola = value - slope * slope / (2 * d[1]);
    return parabola - fabs(d[2]) * w * w * w / 6 - s->fourth * w * w * w * w / 24;
}

/* Minimum by branch and bound: each interval that may have values below the best one is halved
   until its bound is within the tolerance. 48 halvings of 2 pi reach the spacing of doubles. After
   DEM2DI_SERIES_PIECES intervals the remaining ones are not halved: their bounds are valid, but
   less sharp. */
#define DEM2DI_SERIES_PIECES 1000000

static dem2di_bounds dem2di_series_minimum(const dem2di_series *s, double tolerance) {
    struct {
        double centre, half;
        int depth;
    } stack[64];
    int pieces = 4 * s->order + 4, budget = DEM2DI_SERIES_PIECES;
    double d[3], width = DEM2DI_PI / pieces;
    dem2di_bounds bounds;
    bounds.upper = dem2di_series_value(s, 0, d);
    for (int i = 1; i < pieces; i++)
        bounds.upper = dem2di_min(bounds.upper, dem2di_series_value(s, 2 * i * width, d));
    bounds.lower = bounds.upper;
    for (int i = 0; i < pieces; i++) {
        int top = 0;
        stack[0].centre = 2 * i * width;
        stack[0].half = width;
        stack[0].depth = 0;
        while (top >= 0) {
            double t = stack[top].centre, w = stack[top].half;
            int depth = stack[top].depth;
            double value = dem2di_series_value(s, t, d);
            double lower = dem2di_taylor_bound(s, value, d, w);
            bounds.upper = dem2di_min(bounds.upper, value);
            top--;
            if (lower >= bounds.upper - tolerance || depth == 48 || --budget < 0) {
                bounds.lower = dem2di_min(bounds.lower, lower);
                continue;
            }
            for (int side = 0; side < 2; side++) {
                top++;
                stack[top].centre = t + (side == 0 ? w / 2 : -w / 2);
                stack[top].half = w / 2;
                stack[top].depth = depth + 1;
            }
        }
    }
    bounds.lower = dem2di_min(bounds.lower, bounds.upper);
    return bounds;
}

/* ============================================================================================
   >>support  The template in memory and its support point in a unit direction
   uses: config, math, memory
   ============================================================================================ */

/* Up to this many corners a loop over all of them is as fast as the sector table: 4.9 against 6.3
   ns with four corners, 6.2 ns each with six, 7.3 against 6.3 ns with eight. */
#define DEM2DI_FEW_CORNERS 6

/* One arc: its first point and the three differences of its control points. If these are equal the
   arc is straight; if they are zero it is a corner. */
typedef struct dem2di_arc {
    dem2d_vec start, d0, d1, d2;
} dem2di_arc;

/* The straight arcs before and after a part of a polybezier; -1 if it has none. For a straight arc
   both are itself. */
typedef struct dem2di_edges_beside {
    int before, after;
} dem2di_edges_beside;

/* Four terms n, n+1, n+2, n+3 of a Fourier series, n times them for the derivative, and n^2. */
typedef struct dem2di_block {
    double a[4], b[4], na[4], nb[4], square[4];
} dem2di_block;

/* Number of sectors of directions with a lower bound of rho each: 32 in a quadrant. */
#define DEM2DI_RHO_SECTORS 128

struct dem2d_shape {
    dem2d_shape_type type;
    int count;        /* vertices, arcs, order, as given by the caller */
    int parts;        /* polygon: count; Bezier: repaired arcs and corners, for contacts */
    int sectors;      /* length of the sector table, a power of two, or 0 */
    bool flat;        /* has edges: a polygon, or a Bezier with straight arcs */
    double a, b;      /* circle: radius; ellipse: squared half axes; Fourier: a0/2 */
    double deviation; /* Bezier: greatest distance of the parts from the caller's arcs */
    double rounding;
    double circumscribed, inscribed, rho_min;
    double rho_max; /* without edges and straight arcs; custom: 0, not known */
    dem2d_mass mass;
    dem2d_vec offset;
    dem2d_support_fn *function;
    void *function_user;
    int function_tag;
    dem2d_env env;
    size_t bytes;
    /* The arrays follow the struct in the same block of memory: */
    dem2d_vec *corners;  /* polygon: count */
    dem2d_vec *tangents; /* unit tangent; polygon: of the edge leaving k; Bezier: at the end of k */
    dem2di_arc *given;   /* Bezier: count, the caller's, for the mass and the outline */
    dem2di_arc *arcs;    /* Bezier: parts, for the support */
    dem2di_edges_beside *edges_beside; /* Bezier: parts */
    dem2di_block *blocks;              /* Fourier: terms 1..order, padded with zeros */
    double *least_rho; /* smooth, not a circle: least rho in the sectors k and k + 1 */
    int *sector;       /* first guess of the corner or arc for a range of directions */
};

static int dem2di_block_count(int order) {
    return (order + 3) / 4;
}

/* Place the arrays of a shape after the struct; bytes is the size of all. */
static void dem2di_shape_layout(dem2d_shape *shape) {
    char *next = (char *)(shape + 1);
    bool bezier = shape->type == DEM2D_BEZIER, fourier = shape->type == DEM2D_FOURIER;
    size_t parts = (size_t)shape->parts, given = bezier ? (size_t)shape->count : 0;
    size_t corners = shape->type == DEM2D_POLYGON ? parts : 0, arcs = bezier ? parts : 0;
    size_t blocks = fourier ? (size_t)dem2di_block_count(shape->count) : 0;
    size_t least = bezier || fourier || shape->type == DEM2D_ELLIPSE ? DEM2DI_RHO_SECTORS : 0;
    shape->corners = (dem2d_vec *)dem2di_next_array(&next, corners, sizeof(dem2d_vec));
    shape->arcs = (dem2di_arc *)dem2di_next_array(&next, arcs, sizeof(dem2di_arc));
    shape->given = (dem2di_arc *)dem2di_next_array(&next, given, sizeof(dem2di_arc));
    shape->edges_beside =
        (dem2di_edges_beside *)dem2di_next_array(&next, arcs, sizeof(dem2di_edges_beside));
    shape->tangents = (dem2d_vec *)dem2di_next_array(&next, corners + arcs, sizeof(dem2d_vec));
    shape->blocks = (dem2di_block *)dem2di_next_array(&next, blocks, sizeof(dem2di_block));
    shape->least_rho = (double *)dem2di_next_array(&next, least, sizeof(double));
    shape->sector = (int *)dem2di_next_array(&next, (size_t)shape->sectors, sizeof(int));
    shape->bytes = (size_t)(next - (char *)shape);
}

/* Pseudo-angle of a direction in [3, 7], monotone in the angle, 4 for a full turn: y/(|x| + |y|) in
   the first quadrant. It needs no trigonometry, and no branches: a quadrant can't be predicted. */
static inline double dem2di_pseudo_angle(dem2d_vec u) {
    return 5 - copysign(1 - u.y / (fabs(u.x) + fabs(u.y)), u.x);
}

/* The sector of the table least_rho that contains a direction. */
static int dem2di_rho_sector(dem2d_vec u) {
    return (int)(dem2di_pseudo_angle(u) * (DEM2DI_RHO_SECTORS / 4)) & (DEM2DI_RHO_SECTORS - 1);
}

/* Lower bounds of rho over one sector's width from a direction: [0] clockwise, [1]
   counter-clockwise. */
static inline void dem2di_least_rho(const dem2d_shape *shape, dem2d_vec u, double rho[2]) {
    if (shape->least_rho == NULL) {
        rho[0] = rho[1] = shape->rho_min;
        return;
    }
    int k = dem2di_rho_sector(u);
    rho[0] = shape->least_rho[(k - 1) & (DEM2DI_RHO_SECTORS - 1)];
    rho[1] = shape->least_rho[k];
}

/* Lower bound of rho over the directions from one to another, counter-clockwise, at most half a
   turn. */
static double dem2di_least_rho_between(const dem2d_shape *shape, dem2d_vec from, dem2d_vec to) {
    if (shape->least_rho == NULL) return shape->rho_min;
    int k = dem2di_rho_sector(from), last = dem2di_rho_sector(to);
    double least = shape->least_rho[k];
    while (k != last) {
        least = dem2di_min(least, shape->least_rho[k]);
        k = (k + 1) & (DEM2DI_RHO_SECTORS - 1);
    }
    return least;
}

/* Index one step (+1 or -1) from k around a polygon, without a branch, which could not be
   predicted. */
static inline int dem2di_around(int count, int k, int step) {
    k += step;
    return k + count * ((k < 0) - (k == count));
}

/* The corner (polygon) or part (Bezier) that has the support point: advance while the support value
   still grows at its end. */
static inline int dem2di_sector_find(const dem2d_shape *shape, dem2d_vec u) {
    int k = 0;
    if (shape->sectors > 0) {
        int place = (int)(dem2di_pseudo_angle(u) * (shape->sectors / 4));
        k = shape->sector[place & (shape->sectors - 1)];
    }
    /* once around at most: a damaged snapshot may have any tangents */
    for (int left = shape->parts; dem2di_dot(shape->tangents[k], u) > 0 && left > 0; left--)
        k = k + 1 < shape->parts ? k + 1 : 0;
    return k;
}

/* The corner of a polygon farthest along a direction. */
static inline int dem2di_polygon_corner(const dem2d_shape *shape, dem2d_vec u) {
    if (shape->sectors > 0) return dem2di_sector_find(shape, u);
    int best = 0;
    double value = dem2di_dot(shape->corners[0], u);
    for (int k = 1; k < shape->count; k++) {
        double other = dem2di_dot(shape->corners[k], u);
        if (other > value) {
            value = other;
            best = k;
        }
    }
    return best;
}

/* Point of an arc at t: start + 3 times the integral of (1-t)^2 d0 + 2t(1-t) d1 + t^2 d2. */
static dem2d_vec dem2di_arc_point(const dem2di_arc *arc, double t) {
    double w0 = t * (3 - t * (3 - t)), w1 = t * t * (3 - 2 * t), w2 = t * t * t;
    return dem2di_vec(arc->start.x + w0 * arc->d0.x + w1 * arc->d1.x + w2 * arc->d2.x,
                      arc->start.y + w0 * arc->d0.y + w1 * arc->d1.y + w2 * arc->d2.y);
}

/* B'/3 at t. */
static dem2d_vec dem2di_arc_speed(const dem2di_arc *arc, double t) {
    double s = 1 - t;
    return dem2di_add(dem2di_along(dem2di_scale(arc->d0, s * s), 2 * t * s, arc->d1),
                      dem2di_scale(arc->d2, t * t));
}

/* |B'|^3 / B' x B'': 0 where B' vanishes (infinite curvature), HUGE_VAL where the arc is flat. */
static double dem2di_arc_rho(const dem2di_arc *arc, double t) {
    dem2d_vec first = dem2di_arc_speed(arc, t);
    dem2d_vec second = dem2di_add(dem2di_scale(dem2di_sub(arc->d1, arc->d0), 1 - t),
                                  dem2di_scale(dem2di_sub(arc->d2, arc->d1), t));
    double speed = dem2di_length(first), turn = dem2di_cross(first, second);
    if (speed == 0) return 0;
    /* B' = 3 first and B'' = 6 second: 27/18 */
    return turn > 0 ? 1.5 * speed * (speed / turn * speed) : HUGE_VAL;
}

/* [P] sec. 2.2, eq. 9, corrected: the root of q0 (1-t)^2 + 2 q1 t(1-t) + q2 t^2. Its denominator is
   a sum of terms of one sign, so that nothing cancels and t is in [0, 1]. */
static double dem2di_arc_parameter(double q0, double q1, double q2) {
    if (q2 > 0) return 1;
    if (q0 < 0) return 0;
    double root = sqrt(q1 * q1 - q0 * q2);
    double top = q1 > 0 ? root + q1 : q0;
    double bottom = q1 > 0 ? top - q2 : q0 + (root - q1);
    return bottom > 0 ? top / bottom : 0;
}

/* Support point of an arc. rho = |B'|^2 / (-B''.u) = 3/2 speed^2 / bend, with speed = |B'|/3 and
   bend = -B''.u/6; at the root, bend is the square root in [P]'s formula. */
static inline dem2d_vec dem2di_arc_support(const dem2di_arc *arc, dem2d_vec u, double *rho) {
    double q0 = dem2di_dot(arc->d0, u), q1 = dem2di_dot(arc->d1, u), q2 = dem2di_dot(arc->d2, u);
    double t = dem2di_arc_parameter(q0, q1, q2);
    if (rho != NULL) {
        bool inside = q0 >= 0 && q2 <= 0;
        double bend = inside ? sqrt(q1 * q1 - q0 * q2) : (q0 - q1) * (1 - t) + (q1 - q2) * t;
        double f = 1.5 / bend, s = 1 - t; /* does not wait for the division that gives t */
        double speed = dem2di_cross(u, arc->d0) * (s * s) + dem2di_cross(u, arc->d1) * (2 * t * s) +
                       dem2di_cross(u, arc->d2) * (t * t);
        *rho = speed <= 0 ? 0 : bend > 0 ? speed * speed * f : HUGE_VAL;
    }
    return dem2di_arc_point(arc, t);
}

/* s = p u + p' t and rho = p + p'' with the powers of z = ux + i uy: first z .. z^4, then four
   terms at a time by z^4, so that the chain of dependent products is a quarter of the order. The
   four terms are written out: gcc then keeps them in registers, which halves the time. */
static dem2d_vec dem2di_fourier_support(const dem2d_shape *shape, dem2d_vec u, double *rho) {
    double x1 = u.x, y1 = u.y, x2 = x1 * x1 - y1 * y1, y2 = 2 * x1 * y1;
    double x3 = x2 * x1 - y2 * y1, y3 = x2 * y1 + y2 * x1, x4 = x2 * x2 - y2 * y2, y4 = 2 * x2 * y2;
    const double fx = x4, fy = y4;
    double p = 0, q = 0, r = 0, p_odd = 0, q_odd = 0, r_odd = 0;
    const dem2di_block *block = shape->blocks, *end = block + dem2di_block_count(shape->count);
    while (block < end) {
        double e1 = block->a[0] * x1 + block->b[0] * y1, e2 = block->a[1] * x2 + block->b[1] * y2;
        double e3 = block->a[2] * x3 + block->b[2] * y3, e4 = block->a[3] * x4 + block->b[3] * y4;
        p += e1 + e2;
        p_odd += e3 + e4;
        r += block->square[0] * e1 + block->square[1] * e2;
        r_odd += block->square[2] * e3 + block->square[3] * e4;
        q += (block->nb[0] * x1 - block->na[0] * y1) + (block->nb[1] * x2 - block->na[1] * y2);
        q_odd += (block->nb[2] * x3 - block->na[2] * y3) + (block->nb[3] * x4 - block->na[3] * y4);
        if (++block == end) break;
        double turned = x1 * fx - y1 * fy;
        y1 = x1 * fy + y1 * fx, x1 = turned;
        turned = x2 * fx - y2 * fy;
        y2 = x2 * fy + y2 * fx, x2 = turned;
        turned = x3 * fx - y3 * fy;
        y3 = x3 * fy + y3 * fx, x3 = turned;
        turned = x4 * fx - y4 * fy;
        y4 = x4 * fy + y4 * fx, x4 = turned;
    }
    double value = shape->a + (p + p_odd), slope = q + q_odd;
    if (rho != NULL) *rho = dem2di_max(0, value - (r + r_odd));
    return dem2di_vec(value * u.x - slope * u.y, value * u.y + slope * u.x);
}

static inline dem2d_vec dem2di_ellipse_support(const dem2d_shape *shape, dem2d_vec u, double *rho) {
    dem2d_vec s = dem2di_vec(shape->a * u.x, shape->b * u.y);
    double f = 1 / sqrt(s.x * u.x + s.y * u.y);
    if (rho != NULL) *rho = shape->a * f * (shape->b * f) * f;
    return dem2di_vec(s.x * f, s.y * f);
}

/* Straight parts of a polybezier have three equal differences, to the bit. */
static bool dem2di_arc_straight(const dem2di_arc *arc) {
    dem2d_vec d = arc->d0;
    return (d.x != 0 || d.y != 0) && d.x == arc->d1.x && d.y == arc->d1.y && d.x == arc->d2.x &&
           d.y == arc->d2.y;
}

/* Find the edges of a shape: of a polygon all, of a polybezier the straight arcs, each between two
   other parts. */
static void dem2di_find_edges(dem2d_shape *shape) {
    int n = shape->parts, last = -1;
    shape->flat = shape->type == DEM2D_POLYGON;
    if (shape->type != DEM2D_BEZIER) return;
    for (int i = 0; i < 2 * n; i++) {
        if (dem2di_arc_straight(&shape->arcs[i % n])) last = i % n;
        shape->edges_beside[i % n].before = last;
    }
    shape->flat = last >= 0;
    for (int i = 2 * n - 1; i >= 0; i--) {
        if (dem2di_arc_straight(&shape->arcs[i % n])) last = i % n;
        shape->edges_beside[i % n].after = last;
    }
}

static inline bool dem2di_has_parts(const dem2d_shape *shape) {
    return shape->type == DEM2D_POLYGON || shape->type == DEM2D_BEZIER;
}

/* The part (not an edge) that has the support point; only for shapes with parts. */
static inline int dem2di_part_find(const dem2d_shape *shape, dem2d_vec u) {
    return shape->type == DEM2D_POLYGON ? dem2di_polygon_corner(shape, u)
                                        : dem2di_sector_find(shape, u);
}

/* The edge before (-1) or after (1) a part. An edge of a polygon has the number of its first
   corner. */
static inline int dem2di_edge_beside(const dem2d_shape *shape, int k, int side) {
    if (shape->type == DEM2D_POLYGON) return side > 0 ? k : dem2di_around(shape->count, k, -1);
    return side > 0 ? shape->edges_beside[k].after : shape->edges_beside[k].before;
}

/* The part at the start (side -1) or at the end (1) of an edge. */
static inline int dem2di_edge_part(const dem2d_shape *shape, int edge, int side) {
    if (shape->type == DEM2D_POLYGON) return side < 0 ? edge : dem2di_around(shape->count, edge, 1);
    return dem2di_around(shape->parts, edge, side);
}

/* The first point of an edge, or its last. */
static inline dem2d_vec dem2di_edge_end(const dem2d_shape *shape, int edge, bool last) {
    int k = last ? dem2di_around(shape->parts, edge, 1) : edge;
    return shape->type == DEM2D_POLYGON ? shape->corners[k] : shape->arcs[k].start;
}

/* Support point of a template in a unit direction; rho (may be NULL) gets the radius of
   curvature. */
static inline dem2d_vec dem2di_support(const dem2d_shape *shape, dem2d_vec u, double *rho) {
    dem2d_vec s;
    switch (shape->type) {
    case DEM2D_CIRCLE:
        if (rho != NULL) *rho = shape->a;
        return dem2di_scale(u, shape->a);
    case DEM2D_ELLIPSE:
        return dem2di_ellipse_support(shape, u, rho);
    case DEM2D_BEZIER:
        return dem2di_arc_support(&shape->arcs[dem2di_sector_find(shape, u)], u, rho);
    case DEM2D_FOURIER:
        return dem2di_fourier_support(shape, u, rho);
    case DEM2D_CUSTOM:
        if (rho != NULL) *rho = 0;
        return dem2di_sub(shape->function(shape->function_user, u, rho), shape->offset);
    case DEM2D_POLYGON:
    case DEM2D_SHAPE_TYPE_COUNT:
        break;
    }
    if (rho != NULL) *rho = shape->rounding;
    s = shape->corners[dem2di_polygon_corner(shape, u)];
    return shape->rounding > 0 ? dem2di_along(s, shape->rounding, u) : s;
}

/* ============================================================================================
   >>mass  Area, centroid and polar moment: exact per model, and by interpolation
   uses: config, math, fields, hull, series, support
   ============================================================================================ */

/* Area and moments about the origin, summed over pieces. */
typedef struct dem2di_moments {
    double area;     /* m2 */
    dem2d_vec first; /* m3: area times centroid */
    double polar;    /* m4, about the origin */
} dem2di_moments;

static dem2d_mass dem2di_mass_of(const dem2di_moments *m) {
    dem2d_mass mass;
    mass.area = m->area;
    mass.centroid = dem2di_scale(m->first, 1 / m->area);
    mass.polar_moment = m->polar - dem2di_dot(m->first, mass.centroid);
    return mass;
}

/* Adds the triangle of the origin and an edge from a to b ([P] eq. 10-11). */
static void dem2di_add_triangle(dem2di_moments *m, dem2d_vec a, dem2d_vec b) {
    double area = dem2di_cross(a, b) / 2;
    m->area += area;
    m->first = dem2di_along(m->first, area / 3, dem2di_add(a, b));
    m->polar += area / 6 * (dem2di_dot(a, a) + dem2di_dot(a, b) + dem2di_dot(b, b));
}

/* Adds a piece with an area, a centroid c and a polar moment about c. */
static void dem2di_add_piece(dem2di_moments *m, double area, dem2d_vec c, double polar) {
    m->area += area;
    m->first = dem2di_along(m->first, area, c);
    m->polar += polar + area * dem2di_dot(c, c);
}

static dem2d_mass dem2di_polygon_mass(const dem2d_vec *points, int count) {
    dem2di_moments m = {0, {0, 0}, 0};
    for (int i = 1; i + 1 < count; i++) /* a fan about the first point */
        dem2di_add_triangle(&m, dem2di_sub(points[i], points[0]),
                            dem2di_sub(points[i + 1], points[0]));
    dem2d_mass mass = dem2di_mass_of(&m);
    if (mass.area < 0) {
        mass.area = -mass.area;
        mass.polar_moment = -mass.polar_moment;
    }
    mass.centroid = dem2di_add(mass.centroid, points[0]);
    return mass;
}

DEM2D_API dem2d_result dem2d_polygon_mass(const dem2d_vec *points, int count, dem2d_mass *mass) {
    dem2d_result result = dem2di_check_points(NULL, "points", points, count, 3);
    if (result != DEM2D_OK) return result;
    if (mass == NULL) return DEM2D_NULL_ARGUMENT;
    double size = dem2di_coordinate_size(points, count), extent = 0;
    for (int i = 1; i < count; i++)
        extent = dem2di_max(extent, dem2di_length(dem2di_sub(points[i], points[0])));
    if (fabs(dem2di_twice_area(points, count)) <= 8 * DBL_EPSILON * size * extent)
        return DEM2D_ZERO_AREA;
    *mass = dem2di_polygon_mass(points, count);
    return DEM2D_OK;
}

/* A polygon grown by r: the polygon, a rectangle on each edge, a sector at each corner. */
static dem2d_mass dem2di_rounded_polygon_mass(const dem2d_vec *corners, int count, double r) {
    dem2d_mass core = dem2di_polygon_mass(corners, count);
    dem2di_moments m = {0, {0, 0}, 0};
    dem2di_add_piece(&m, core.area, dem2di_vec(0, 0), core.polar_moment);
    for (int k = 0; k < count && r > 0; k++) {
        dem2d_vec corner = dem2di_sub(corners[k], core.centroid);
        dem2d_vec edge = dem2di_sub(corners[(k + 1) % count], corners[k]);
        dem2d_vec last = dem2di_sub(corners[k], corners[(k + count - 1) % count]);
        double length = dem2di_length(edge), turn = dem2di_angle(last, edge);
        dem2d_vec normal = dem2di_scale(dem2di_right(edge), 1 / length);
        dem2d_vec middle = dem2di_along(dem2di_along(corner, 0.5, edge), r / 2, normal);
        dem2di_add_piece(&m, length * r, middle, length * r * (length * length + r * r) / 12);
        dem2d_rot half = dem2d_rot_make(-turn / 2); /* from the edge's normal to the bisector */
        double area = r * r * turn / 2, reach = -4 * r * half.s / (3 * turn);
        dem2d_vec centre = dem2di_along(corner, reach, dem2di_turn(half, normal));
        dem2di_add_piece(&m, area, centre, area * (r * r / 2 - reach * reach));
    }
    dem2d_mass mass = dem2di_mass_of(&m);
    mass.centroid = dem2di_add(mass.centroid, core.centroid);
    return mass;
}

/* Mass of an FS by the trapezoid rule (first moments 1/3 int s p rho, polar moment 1/4 int (p^2 +
   p'^2) p rho): the integrands have degree 4N at most, so more than 4N points are exact. */
static dem2d_mass dem2di_fourier_mass(const double *a, const double *b, int order) {
    dem2di_series series = dem2di_series_make(a, b, order, false, 1);
    dem2di_series radius = dem2di_series_make(a, b, order, true, 1);
    dem2di_moments m = {0, {0, 0}, 0};
    int points = 4 * order + 8;
    for (int i = 0; i < points; i++) {
        double t = 2 * DEM2DI_PI * i / points, d[3], unused[3];
        double p = dem2di_series_value(&series, t, d);
        double weight = 2 * DEM2DI_PI / points * p * dem2di_series_value(&radius, t, unused);
        dem2d_rot z = dem2d_rot_make(t);
        dem2d_vec s = dem2di_turn(z, dem2di_vec(p, d[0]));
        m.area += weight / 2;
        m.first = dem2di_along(m.first, weight / 3, s);
        m.polar += weight / 4 * dem2di_dot(s, s);
    }
    return dem2di_mass_of(&m);
}

/* Point i of six in [0, 1] and its weight (their sum is 2): Gauss-Legendre, exact to degree 11. */
static double dem2di_gauss_point(int i, double *weight) {
    static const double node[3] = {0.2386191860831969086, 0.6612093864662645136,
                                   0.9324695142031520278};
    static const double weights[3] = {0.4679139345726910473, 0.3607615730481386076,
                                      0.1713244923791703450};
    *weight = weights[i % 3];
    return 0.5 + (i < 3 ? 0.5 : -0.5) * node[i % 3];
}

/* Mass inside Bezier arcs: the polar moment 1/4 int |B|^2 B x B' has degree 6 + 5. */
static dem2d_mass dem2di_bezier_mass(const dem2di_arc *arcs, int count) {
    dem2di_moments m = {0, {0, 0}, 0};
    for (int k = 0; k < count; k++)
        for (int i = 0; i < 6; i++) {
            double weight, t = dem2di_gauss_point(i, &weight);
            dem2d_vec point = dem2di_arc_point(&arcs[k], t);
            double sweep = 1.5 * weight * dem2di_cross(point, dem2di_arc_speed(&arcs[k], t));
            m.area += sweep / 2;
            m.first = dem2di_along(m.first, sweep / 3, point);
            m.polar += sweep / 4 * dem2di_dot(point, point);
        }
    return dem2di_mass_of(&m);
}

DEM2D_API dem2d_result dem2d_shape_mass(const dem2d_shape *shape, dem2d_mass *mass) {
    if (shape == NULL || mass == NULL) return DEM2D_NULL_ARGUMENT;
    *mass = shape->mass;
    return DEM2D_OK;
}

/* Point j of `each` on the circular arc at corner k of a rounded polygon. */
static dem2d_vec dem2di_rounded_point(const dem2d_shape *shape, int k, int j, int each) {
    int n = shape->count;
    dem2d_vec in, out, u;
    (void)dem2di_unit(dem2di_right(shape->tangents[(k + n - 1) % n]), &in);
    (void)dem2di_unit(dem2di_right(shape->tangents[k]), &out);
    u = dem2di_turn(dem2d_rot_make(dem2di_angle(in, out) * j / (each - 1)), in);
    return dem2di_along(shape->corners[k], shape->rounding, u);
}

/* Point i of count on the boundary of a template. Each edge (or arc) has about as many points, so
   that every corner (or knot) is one of them if there are enough. */
static dem2d_vec dem2di_outline_point(const dem2d_shape *shape, int i, int count) {
    int n = shape->count;
    if (shape->type == DEM2D_POLYGON || shape->type == DEM2D_BEZIER) {
        int64_t place = (int64_t)i * n;
        int k = (int)(place / count);                        /* corner or arc */
        int first = (int)(((int64_t)k * count + n - 1) / n); /* first point on it */
        int each = (int)(((int64_t)(k + 1) * count + n - 1) / n) - first;
        double t = (double)(i - first) / each;
        if (shape->type == DEM2D_BEZIER)
            return dem2di_arc_point(&shape->given[k], (double)(place % count) / count);
        if (shape->rounding == 0) {
            dem2d_vec edge = dem2di_sub(shape->corners[(k + 1) % n], shape->corners[k]);
            return dem2di_along(shape->corners[k], t, edge);
        }
        if (count >= 2 * n) return dem2di_rounded_point(shape, k, i - first, each);
    }
    return dem2di_support(shape, dem2di_direction(i, count), NULL);
}

/* [P] eq. 10-11 over outline points, without storing them. */
static dem2d_mass dem2di_mass_interpolated(const dem2d_shape *shape, int count) {
    dem2di_moments m = {0, {0, 0}, 0};
    dem2d_vec first = dem2di_outline_point(shape, 0, count), point = first;
    for (int i = 1; i <= count; i++) {
        dem2d_vec next = i < count ? dem2di_outline_point(shape, i, count) : first;
        dem2di_add_triangle(&m, point, next);
        point = next;
    }
    return dem2di_mass_of(&m);
}

DEM2D_API dem2d_result dem2d_shape_mass_interpolated(const dem2d_shape *shape, int count,
                                                     dem2d_mass *mass) {
    if (shape == NULL || mass == NULL) return DEM2D_NULL_ARGUMENT;
    if (count < 3) return DEM2D_TOO_FEW_POINTS;
    *mass = dem2di_mass_interpolated(shape, count);
    return DEM2D_OK;
}

/* ============================================================================================
   >>shapes  Creation with validation; queries that need only support points
   uses: config, math, memory, fields, hull, series, support, mass
   ============================================================================================ */

/* The sector table has four to eight entries for each corner or part, so that most look-ups need no
   further step and are predicted well. Its length is a power of two. */
static int dem2di_sector_count(int count) {
    int sectors = 16;
    while (sectors / 4 < count && sectors < (1 << 28)) sectors *= 2;
    return sectors;
}

/* Length of a model's sector table: none for a few corners, where a loop is as fast. */
static int dem2di_sectors_of(dem2d_shape_type type, int count) {
    bool table = type == DEM2D_BEZIER || (type == DEM2D_POLYGON && count > DEM2DI_FEW_CORNERS);
    return table ? dem2di_sector_count(count) : 0;
}

/* A zeroed template of a model with its arrays placed. */
static dem2d_shape *dem2di_shape_allocate(const dem2d_env *env, dem2d_shape_type type, int count,
                                          int parts) {
    dem2d_shape plan;
    memset(&plan, 0, sizeof plan);
    plan.type = type;
    plan.count = count;
    plan.parts = parts;
    plan.sectors = dem2di_sectors_of(type, parts);
    dem2di_shape_layout(&plan);
    dem2d_shape *shape = (dem2d_shape *)dem2di_allocate(env, 1, plan.bytes);
    if (shape == NULL) {
        (void)dem2di_fail(env, DEM2D_OUT_OF_MEMORY, -1, "no memory for a shape of %.0f bytes",
                          (double)plan.bytes);
        return NULL;
    }
    memset((void *)shape, 0, plan.bytes);
    shape->type = type;
    shape->count = count;
    shape->parts = parts;
    shape->sectors = plan.sectors;
    dem2di_shape_layout(shape);
    if (env != NULL) shape->env = *env;
    return shape;
}

/* Refuses sizes whose fourth power is not a normal number: their polar moment is not accurate. */
static dem2d_result dem2di_check_mass(const dem2d_env *env, double area, double polar_moment) {
    if (dem2di_finite(polar_moment) && area >= DBL_MIN && polar_moment >= DBL_MIN) return DEM2D_OK;
    return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "size: area %g, polar moment %g", area,
                       polar_moment);
}

DEM2D_API void dem2d_shape_destroy(dem2d_shape *shape) {
    if (shape == NULL) return;
    dem2d_env env = shape->env;
    dem2di_release(&env, shape, 1, shape->bytes);
}

/* A copy in the memory of another environment. */
static dem2d_shape *dem2di_shape_copy(const dem2d_env *env, const dem2d_shape *shape) {
    dem2d_shape *copy = dem2di_shape_allocate(env, shape->type, shape->count, shape->parts);
    if (copy == NULL) return NULL;
    dem2d_env own = copy->env;
    memcpy((void *)copy, (const void *)shape, shape->bytes);
    copy->env = own;
    dem2di_shape_layout(copy);
    return copy;
}

/* The last step of creation: a shape whose moments are not normal numbers is destroyed again. */
static dem2d_result dem2di_shape_finish(dem2d_shape *made, dem2d_shape **shape) {
    dem2d_result result = dem2di_check_mass(&made->env, made->mass.area, made->mass.polar_moment);
    if (result == DEM2D_OK)
        *shape = made;
    else
        dem2d_shape_destroy(made);
    return result;
}

static double dem2di_half_width(const dem2d_shape *shape, double x, double y) {
    dem2d_vec u = dem2di_vec(x, y);
    return dem2di_dot(dem2di_support(shape, u, NULL), u);
}

DEM2D_API dem2d_result dem2d_shape_create_circle(const dem2d_env *env, double radius,
                                                 dem2d_shape **shape) {
    if (shape == NULL) return dem2di_fail_null(env, "shape");
    dem2d_result result = dem2di_check_number(env, "radius", radius, DEM2DI_FROM_0);
    if (result != DEM2D_OK) return result;
    if (radius == 0) return dem2di_fail(env, DEM2D_ZERO_AREA, -1, "radius = 0 must be above 0");
    double area = DEM2DI_PI * radius * radius, polar = area * radius * radius / 2;
    result = dem2di_check_mass(env, area, polar);
    if (result != DEM2D_OK) return result;
    dem2d_shape *made = dem2di_shape_allocate(env, DEM2D_CIRCLE, 0, 0);
    if (made == NULL) return DEM2D_OUT_OF_MEMORY;
    made->a = made->circumscribed = made->inscribed = made->rho_min = made->rho_max = radius;
    made->mass.area = area;
    made->mass.polar_moment = polar;
    *shape = made;
    return DEM2D_OK;
}

/* The direction, not normalised, at the start of one of `sectors` sectors of a full turn: the
   inverse of the pseudo-angle. */
static dem2d_vec dem2di_sector_start(int sector, int sectors) {
    double f = 4.0 * sector / sectors, g = f < 2 ? 1 - f : f - 3; /* x with |x| + |y| = 1 */
    return dem2di_vec(g, f < 1 ? f : f < 3 ? 2 - f : f - 4);
}

/* From the least rho of each sector to the least of each sector and the next one. */
static inline void dem2di_least_rho_join(dem2d_shape *shape) {
    double first = shape->least_rho[0];
    for (int k = 0; k < DEM2DI_RHO_SECTORS; k++)
        shape->least_rho[k] = dem2di_min(
            shape->least_rho[k], k + 1 < DEM2DI_RHO_SECTORS ? shape->least_rho[k + 1] : first);
}

/* rho is monotone in each quadrant, so its least value in a sector is at an end of the sector. */
static void dem2di_ellipse_least_rho(dem2d_shape *shape) {
    for (int k = 0; k < DEM2DI_RHO_SECTORS; k++) {
        dem2d_vec u = dem2di_vec(1, 0);
        double rho[2];
        for (int i = 0; i < 2; i++) {
            (void)dem2di_unit(dem2di_sector_start((k + i) % DEM2DI_RHO_SECTORS, DEM2DI_RHO_SECTORS),
                              &u);
            (void)dem2di_ellipse_support(shape, u, &rho[i]);
        }
        shape->least_rho[k] = (1 - 8 * DBL_EPSILON) * dem2di_min(rho[0], rho[1]);
    }
    dem2di_least_rho_join(shape);
}

DEM2D_API dem2d_result dem2d_shape_create_ellipse(const dem2d_env *env, double a, double b,
                                                  dem2d_shape **shape) {
    if (shape == NULL) return dem2di_fail_null(env, "shape");
    dem2d_result result = dem2di_check_number(env, "a", a, DEM2DI_FROM_0);
    if (result == DEM2D_OK) result = dem2di_check_number(env, "b", b, DEM2DI_FROM_0);
    if (result != DEM2D_OK) return result;
    if (a == 0 || b == 0)
        return dem2di_fail(env, DEM2D_ZERO_AREA, -1, "half axes a = %g, b = %g must be above 0", a,
                           b);
    double area = DEM2DI_PI * a * b, polar = area * (a * a + b * b) / 4;
    result = dem2di_check_mass(env, area, polar);
    if (result == DEM2D_OK) result = dem2di_check_mass(env, a * a, b * b);
    if (result != DEM2D_OK) return result;
    dem2d_shape *made = dem2di_shape_allocate(env, DEM2D_ELLIPSE, 0, 0);
    if (made == NULL) return DEM2D_OUT_OF_MEMORY;
    made->a = a * a;
    made->b = b * b;
    made->circumscribed = dem2di_max(a, b);
    made->inscribed = dem2di_min(a, b);
    made->rho_min = made->inscribed * (made->inscribed / made->circumscribed);
    made->rho_max = made->circumscribed * (made->circumscribed / made->inscribed);
    made->mass.area = area;
    made->mass.polar_moment = polar;
    dem2di_ellipse_least_rho(made);
    *shape = made;
    return DEM2D_OK;
}

/* Entry s of the sector table: the corner or part that has the support point in the first direction
   of sector s. */
static void dem2di_fill_sectors(dem2d_shape *shape) {
    int sectors = shape->sectors, k = 0;
    for (int s = 0; s < sectors; s++) {
        dem2d_vec u = dem2di_sector_start(s, sectors);
        if (s == 0) { /* the support value grows at the start of this part, not at its end */
            while (!(dem2di_dot(shape->tangents[(k + shape->parts - 1) % shape->parts], u) > 0 &&
                     dem2di_dot(shape->tangents[k], u) <= 0) &&
                   k + 1 < shape->parts)
                k++;
        }
        for (int left = shape->parts; dem2di_dot(shape->tangents[k], u) > 0 && left > 0; left--)
            k = (k + 1) % shape->parts;
        shape->sector[s] = k;
    }
}

/* Radii of a polygon about its centroid, the origin. */
static void dem2di_polygon_radii(dem2d_shape *shape) {
    double outer = 0, inner = HUGE_VAL, r = shape->rounding;
    for (int k = 0; k < shape->count; k++) {
        outer = dem2di_max(outer, dem2di_length(shape->corners[k]));
        inner = dem2di_min(inner, dem2di_cross(shape->corners[k], shape->tangents[k]));
    }
    shape->circumscribed = outer + r;
    shape->inscribed = inner + r;
    shape->rho_min = shape->rho_max = r;
}

DEM2D_API dem2d_result dem2d_shape_create_polygon(const dem2d_env *env, const dem2d_vec *points,
                                                  int count, double rounding, dem2d_shape **shape) {
    if (shape == NULL) return dem2di_fail_null(env, "shape");
    dem2d_result result = dem2di_check_points(env, "points", points, count, 3);
    if (result == DEM2D_OK) result = dem2di_check_number(env, "rounding", rounding, DEM2DI_FROM_0);
    if (result != DEM2D_OK) return result;
    size_t n = (size_t)count, size = sizeof(dem2d_vec) + sizeof(int);
    dem2d_vec *corners = (dem2d_vec *)dem2di_allocate(env, n, size);
    if (corners == NULL) return dem2di_fail_memory(env, count, "corners");
    memcpy(corners, points, n * sizeof *corners);
    result = dem2di_clean_polygon(env, corners, (int *)(void *)(corners + count), &count);
    dem2d_shape *made = NULL;
    if (result == DEM2D_OK) {
        made = dem2di_shape_allocate(env, DEM2D_POLYGON, count, count);
        if (made == NULL) result = DEM2D_OUT_OF_MEMORY;
    }
    if (made != NULL) {
        made->rounding = rounding;
        dem2di_find_edges(made);
        made->mass = dem2di_rounded_polygon_mass(corners, count, rounding);
        made->offset = made->mass.centroid;
        made->mass.centroid = dem2di_vec(0, 0);
        for (int k = 0; k < count; k++) {
            made->corners[k] = dem2di_sub(corners[k], made->offset);
            (void)dem2di_unit(dem2di_sub(corners[(k + 1) % count], corners[k]), &made->tangents[k]);
        }
        dem2di_fill_sectors(made);
        dem2di_polygon_radii(made);
        result = dem2di_shape_finish(made, shape);
    }
    dem2di_release(env, corners, n, size);
    return result;
}

/* Bounds of an arc's distance from the origin and of its radius of curvature, by halving: the
   control points of a piece bound its values. */
typedef struct dem2di_arc_bounds {
    double outer;       /* upper bound of the distance */
    double inner;       /* lower bound of the distance */
    double rho;         /* lower bound of the radius of curvature */
    double attained[3]; /* greatest distance, least distance, least radius at ends of pieces */
    double tolerance;   /* m */
} dem2di_arc_bounds;

static double dem2di_segment_distance(dem2d_vec a, dem2d_vec b) {
    dem2d_vec edge = dem2di_sub(b, a);
    double square = dem2di_dot(edge, edge);
    double t = square > 0 ? -dem2di_dot(a, edge) / square : 0;
    return dem2di_length(dem2di_along(a, dem2di_max(0, dem2di_min(1, t)), edge));
}

/* Lower bound of rho on an arc: B' x B''/18 is quadratic with the coefficients d0 x d1, d0 x d2 /
   2, d1 x d2, and |B'|/3 is not below the least projection of d0, d1, d2 onto their mean
   direction. */
static double dem2di_arc_rho_lower(const dem2di_arc *arc) {
    dem2d_vec mean;
    dem2d_vec sum = dem2di_add(dem2di_add(arc->d0, arc->d1), arc->d2);
    double turn = dem2di_max(dem2di_cross(arc->d0, arc->d1), dem2di_cross(arc->d1, arc->d2));
    turn = dem2di_max(turn, dem2di_cross(arc->d0, arc->d2) / 2);
    if (!dem2di_unit(sum, &mean)) return 0;
    double speed = dem2di_min(dem2di_dot(arc->d0, mean), dem2di_dot(arc->d2, mean));
    speed = dem2di_max(0, dem2di_min(speed, dem2di_dot(arc->d1, mean)));
    return turn > 0 ? 1.5 * speed * (speed / turn * speed) : HUGE_VAL;
}

/* De Casteljau's subdivision at 1/2, in differences. */
static void dem2di_arc_halves(const dem2di_arc *arc, dem2di_arc half[2]) {
    dem2d_vec a = dem2di_scale(dem2di_add(arc->d0, arc->d1), 0.25);
    dem2d_vec b = dem2di_scale(dem2di_add(arc->d1, arc->d2), 0.25);
    half[0].start = arc->start;
    half[0].d0 = dem2di_scale(arc->d0, 0.5);
    half[0].d1 = a;
    half[0].d2 = half[1].d0 = dem2di_scale(dem2di_add(a, b), 0.5);
    half[1].d1 = b;
    half[1].d2 = dem2di_scale(arc->d2, 0.5);
    half[1].start = dem2di_add(dem2di_add(arc->start, half[0].d0), dem2di_add(a, half[0].d2));
}

static void dem2di_bound_arc(dem2di_arc_bounds *bounds, const dem2di_arc *arc, int depth) {
    dem2d_vec q1 = dem2di_add(arc->start, arc->d0), q2 = dem2di_add(q1, arc->d1);
    dem2d_vec q3 = dem2di_add(q2, arc->d2);
    double ends[2] = {dem2di_length(arc->start), dem2di_length(q3)};
    double outer = dem2di_max(ends[0], ends[1]);
    outer = dem2di_max(outer, dem2di_max(dem2di_length(q1), dem2di_length(q2)));
    double inner = dem2di_segment_distance(arc->start, q3);
    double rho = dem2di_arc_rho_lower(arc), *attained = bounds->attained;
    attained[0] = dem2di_max(attained[0], dem2di_max(ends[0], ends[1]));
    attained[1] = dem2di_min(attained[1], dem2di_min(ends[0], ends[1]));
    attained[2] =
        dem2di_min(attained[2], dem2di_min(dem2di_arc_rho(arc, 0), dem2di_arc_rho(arc, 1)));
    /* a large radius of curvature has a rounding error above any part of the size */
    double small = dem2di_max(bounds->tolerance, 1e-6 * attained[2]);
    bool open = outer > attained[0] + bounds->tolerance ||
                inner < attained[1] - bounds->tolerance || rho < attained[2] - small;
    if (!open || depth == 0) {
        bounds->outer = dem2di_max(bounds->outer, outer);
        bounds->inner = dem2di_min(bounds->inner, inner);
        bounds->rho = dem2di_min(bounds->rho, rho);
        return;
    }
    dem2di_arc half[2];
    dem2di_arc_halves(arc, half);
    dem2di_bound_arc(bounds, &half[0], depth - 1);
    dem2di_bound_arc(bounds, &half[1], depth - 1);
}

/* The first (or last) difference of an arc that is longer than rounding errors; NULL if none is. */
static const dem2d_vec *dem2di_arc_side(const dem2di_arc *arc, double roundoff, bool last) {
    const dem2d_vec *d[3] = {&arc->d0, &arc->d1, &arc->d2};
    for (int i = 0; i < 3; i++) {
        const dem2d_vec *side = d[last ? 2 - i : i];
        if (dem2di_length(*side) > roundoff) return side;
    }
    return NULL;
}

/* Upper bound of rho on an arc: see the lower one. */
static double dem2di_arc_rho_upper(const dem2di_arc *arc) {
    double turn = dem2di_min(dem2di_cross(arc->d0, arc->d1), dem2di_cross(arc->d1, arc->d2));
    turn = dem2di_min(turn, dem2di_cross(arc->d0, arc->d2) / 2);
    double speed = dem2di_max(dem2di_length(arc->d0), dem2di_length(arc->d2));
    speed = dem2di_max(speed, dem2di_length(arc->d1));
    return turn > 0 ? 1.5 * speed * (speed / turn * speed) : HUGE_VAL;
}

/* Upper bound of rho on an arc, or `known` if that is greater, with a relative excess of 1e-3: each
   halving divides the excess by four. */
static double dem2di_arc_rho_search(const dem2di_arc *arc, double known, int depth) {
    known = dem2di_max(known, dem2di_max(dem2di_arc_rho(arc, 0), dem2di_arc_rho(arc, 1)));
    double ceiling = dem2di_arc_rho_upper(arc);
    if (ceiling <= known * 1.001 || depth == 0) return dem2di_max(known, ceiling);
    dem2di_arc half[2];
    dem2di_arc_halves(arc, half);
    known = dem2di_arc_rho_search(&half[0], known, depth - 1);
    return dem2di_arc_rho_search(&half[1], known, depth - 1);
}

/* 12 halvings: where rounding errors hide the curvature, more would not end. */
static double dem2di_arc_rho_max(const dem2di_arc *arc, double known) {
    return dem2di_arc_rho_search(arc, known, 12);
}

/* Tangents at the ends of an arc. */
static bool dem2di_arc_tangents(const dem2di_arc *arc, double roundoff, dem2d_vec *start,
                                dem2d_vec *end) {
    const dem2d_vec *first = dem2di_arc_side(arc, roundoff, false);
    const dem2d_vec *last = dem2di_arc_side(arc, roundoff, true);
    return first != NULL && last != NULL && dem2di_unit(*first, start) && dem2di_unit(*last, end);
}

/* Lower least_rho to rho in the sectors from the normal of one tangent to that of another. */
static void dem2di_least_rho_lower(dem2d_shape *shape, dem2d_vec from, dem2d_vec to, double rho) {
    /* widened, so that no rounding error moves them over the border of a sector */
    from = dem2di_along(from, -1e-12, dem2di_perp(from));
    to = dem2di_along(to, 1e-12, dem2di_perp(to));
    int k = dem2di_rho_sector(dem2di_right(from));
    int last = dem2di_rho_sector(dem2di_right(to));
    for (;; k = (k + 1) & (DEM2DI_RHO_SECTORS - 1)) {
        shape->least_rho[k] = dem2di_min(shape->least_rho[k], rho);
        if (k == last) break;
    }
}

/* The same for an arc, by its lower bound of rho. The arc is halved while it turns by more than
   half a sector or the bound is far below the values at its ends. */
static void dem2di_arc_least_rho(dem2d_shape *shape, const dem2di_arc *arc, int depth) {
    dem2d_vec from, to;
    if (!dem2di_arc_tangents(arc, 0, &from, &to)) return; /* a point */
    double rho = dem2di_arc_rho_lower(arc);
    double met = dem2di_min(dem2di_arc_rho(arc, 0), dem2di_arc_rho(arc, 1));
    bool wide = dem2di_cross(from, to) > 0.03 || dem2di_dot(from, to) < 0;
    if (depth > 0 && (wide || (dem2di_finite(met) && rho < 0.9 * met))) {
        dem2di_arc half[2];
        dem2di_arc_halves(arc, half);
        dem2di_arc_least_rho(shape, &half[0], depth - 1);
        dem2di_arc_least_rho(shape, &half[1], depth - 1);
        return;
    }
    dem2di_least_rho_lower(shape, from, to, rho);
}

/* A knot with this sine between its tangents is smooth, and an arc that turns by it is straight:
   the precision of coordinates with seven digits. */
#define DEM2DI_SMOOTH 1e-6

/* An arc shorter than this part of the size (2^-44 = 256 eps) is a corner: the rounding errors of
   its control points leave it no direction. */
#define DEM2DI_TINY (1.0 / 17592186044416.0)

/* Lengths that are too short to have a direction in a control polygon, m. */
typedef struct dem2di_limits {
    double roundoff; /* rounding error of the difference of two points */
    double tiny;     /* an arc not longer than this is a corner */
} dem2di_limits;

static double dem2di_arc_length(const dem2di_arc *arc) { /* of its control polygon */
    return dem2di_length(arc->d0) + dem2di_length(arc->d1) + dem2di_length(arc->d2);
}

static dem2d_vec dem2di_arc_chord(const dem2di_arc *arc) {
    return dem2di_add(dem2di_add(arc->d0, arc->d1), arc->d2);
}

/* Cross product of two differences (of lengths la, lb) that still counts as parallel: by rounding
   errors of coordinates or by the smoothness. */
static double dem2di_turn_slack(double la, double lb, double roundoff) {
    return dem2di_max(roundoff * (la + lb), DEM2DI_SMOOTH * la * lb);
}

/* Does b turn left from a, or to the right within the smoothness, and not backwards? Also true for
   differences within rounding errors, which have no direction. */
static bool dem2di_turns_left(dem2d_vec a, dem2d_vec b, double roundoff) {
    double la = dem2di_length(a), lb = dem2di_length(b), turn = dem2di_cross(a, b);
    if (la <= roundoff || lb <= roundoff) return true;
    return turn >= -dem2di_turn_slack(la, lb, roundoff) &&
           (turn > roundoff * (la + lb) || dem2di_dot(a, b) > 0);
}

/* Is the arc convex, turning left by at most pi, within the smoothness? Every turn of the control
   polygon is to the left, and so is the total turn. */
static bool dem2di_arc_convex(const dem2di_arc *arc, double roundoff) {
    const dem2d_vec *start = dem2di_arc_side(arc, roundoff, false);
    const dem2d_vec *end = dem2di_arc_side(arc, roundoff, true);
    double slack = dem2di_turn_slack(dem2di_length(*start), dem2di_length(*end), roundoff);
    return dem2di_turns_left(arc->d0, arc->d1, roundoff) &&
           dem2di_turns_left(arc->d1, arc->d2, roundoff) &&
           dem2di_cross(*start, *end) >= -2 * slack; /* slack of two turns */
}

/* Is the knot between two arcs smooth? kink gets the sine between the tangents. */
static bool dem2di_knot_smooth(const dem2di_arc *before, const dem2di_arc *after, double roundoff,
                               double *kink) {
    dem2d_vec a = *dem2di_arc_side(before, roundoff, true);
    dem2d_vec b = *dem2di_arc_side(after, roundoff, false);
    double la = dem2di_length(a), lb = dem2di_length(b), turn = dem2di_cross(a, b);
    *kink = turn / la / lb;
    return fabs(turn) <= dem2di_turn_slack(la, lb, roundoff) && dem2di_dot(a, b) > 0;
}

/* Check the caller's arcs: no arc is a point, each is tiny or convex, and knots between two arcs
   that are not tiny are smooth. */
static dem2d_result dem2di_check_arcs(const dem2d_env *env, const dem2di_arc *arcs, int count,
                                      bool reversed, dem2di_limits limits) {
    const dem2di_arc *before = &arcs[count - 1];
    for (int k = 0; k < count; k++) {
        int place = reversed ? count - 1 - k : k; /* in the caller's numbering */
        const dem2di_arc *arc = &arcs[k];
        double kink;
        if (dem2di_arc_side(arc, limits.roundoff, false) == NULL)
            return dem2di_fail(env, DEM2D_DUPLICATE_POINT, place,
                               "all control points of arc %d coincide", place);
        bool tiny = dem2di_arc_length(arc) <= limits.tiny;
        if (!tiny && !dem2di_arc_convex(arc, limits.roundoff))
            return dem2di_fail(env, DEM2D_NOT_CONVEX, place, "arc %d is not convex", place);
        if (reversed) place = (count - k) % count;
        if (!tiny && dem2di_arc_length(before) > limits.tiny &&
            !dem2di_knot_smooth(before, arc, limits.roundoff, &kink))
            return dem2di_fail(env, DEM2D_NOT_SMOOTH, place,
                               "the tangents at the start of arc %d differ by a sine of %g", place,
                               kink);
        before = arc;
    }
    return DEM2D_OK;
}

static void dem2di_arcs_from_control(const dem2d_vec *control, int count, bool reverse,
                                     dem2di_arc *arcs) {
    int n = 3 * count;
    for (int k = 0; k < count; k++) {
        dem2d_vec q[4];
        for (int i = 0; i < 4; i++) {
            int place = (3 * k + i) % n;
            q[i] = control[reverse ? (n - place) % n : place];
        }
        arcs[k].start = q[0];
        arcs[k].d0 = dem2di_sub(q[1], q[0]);
        arcs[k].d1 = dem2di_sub(q[2], q[1]);
        arcs[k].d2 = dem2di_sub(q[3], q[2]);
    }
}

/* --- repair of the caller's arcs, for contacts ---
   Contact detection needs knots with one tangent, straight arcs that are straight to the bit, arcs
   that turn by at most a right angle, and no arc too short to have a direction. The caller's arcs
   fulfil this only within the smoothness, because coordinates are rounded. The control polygon is
   repaired: differences that should have one direction, and those that turn to the right, are tied
   into a group, and the points between them are moved onto the chord of the group. The greatest
   displacement of a point bounds that of the outline and is part of the error of every contact. */

/* The control polygon of all arcs that are not tiny, as differences. */
typedef struct dem2di_chain {
    int count;        /* of differences, three for each arc */
    dem2d_vec *start; /* of each arc */
    dem2d_vec *d;
    bool *tied; /* d[k] gets the direction of d[k + 1] */
    dem2di_limits limits;
    double noise; /* m, rounding errors of the coordinates as kinks and dents show them */
    /* m, greatest displacement of a point: into corners of tiny arcs, onto chords, into corners of
       parts */
    double cornered, aligned, parted;
} dem2di_chain;

/* The difference at an end of an arc, or the next one that is not tiny. */
static dem2d_vec *dem2di_chain_side(const dem2di_chain *chain, int arc, bool last) {
    dem2d_vec *d = &chain->d[3 * arc + (last ? 2 : 0)];
    if (dem2di_length(*d) <= chain->limits.tiny) d = &chain->d[3 * arc + 1];
    if (dem2di_length(*d) > chain->limits.tiny) return d;
    return &chain->d[3 * arc + (last ? 0 : 2)];
}

/* Tiny arcs between two arcs become a corner: the two meet in the middle of the chord. */
static void dem2di_chain_corner(dem2di_chain *chain, int before, int after, dem2d_vec chord,
                                double length) {
    dem2d_vec half = dem2di_scale(chord, 0.5), *end = dem2di_chain_side(chain, before, true);
    *end = dem2di_add(*end, half);
    end = dem2di_chain_side(chain, after, false);
    *end = dem2di_add(*end, half);
    chain->start[after] = dem2di_sub(chain->start[after], half);
    chain->tied[3 * before + 2] = false;
    chain->cornered = dem2di_max(chain->cornered, length / 2); /* to the middle of its chord */
}

/* Fill the chain with the arcs that are not tiny. False if there are less than two. */
static bool dem2di_chain_set(dem2di_chain *chain, const dem2di_arc *arcs, int count) {
    int first = 0, kept = 0;
    double length = 0; /* of the tiny arcs after the last that was kept */
    dem2d_vec chord = dem2di_vec(0, 0);
    while (first < count && dem2di_arc_length(&arcs[first]) <= chain->limits.tiny) first++;
    for (int i = 0; i < count && first < count; i++) {
        const dem2di_arc *arc = &arcs[(first + i) % count];
        double own = dem2di_arc_length(arc);
        if (own <= chain->limits.tiny) {
            chord = dem2di_add(chord, dem2di_arc_chord(arc));
            length += own;
            continue;
        }
        chain->start[kept] = arc->start;
        chain->d[3 * kept] = arc->d0;
        chain->d[3 * kept + 1] = arc->d1;
        chain->d[3 * kept + 2] = arc->d2;
        chain->tied[3 * kept] = chain->tied[3 * kept + 1] = false;
        chain->tied[3 * kept + 2] = true;
        if (length > 0) dem2di_chain_corner(chain, kept - 1, kept, chord, length);
        chord = dem2di_vec(0, 0);
        length = 0;
        kept++;
    }
    if (kept < 2) return false;
    chain->count = 3 * kept;
    if (length > 0) dem2di_chain_corner(chain, kept - 1, 0, chord, length);
    return true;
}

/* Estimate the rounding errors of the coordinates from kinks of knots and from turns to the right:
   distance of the point between two differences from their chord. */
static void dem2di_chain_noise(dem2di_chain *chain) {
    chain->noise = chain->limits.roundoff / 8; /* of one coordinate */
    for (int k = 0; k < chain->count; k++) {
        dem2d_vec a = chain->d[k], b = chain->d[(k + 1) % chain->count];
        double turn = dem2di_cross(a, b), lengths = dem2di_length(a) + dem2di_length(b);
        bool knot = k % 3 == 2 && chain->tied[k];
        if (knot || turn < 0) chain->noise = dem2di_max(chain->noise, fabs(turn) / lengths);
    }
}

/* Is the arc of differences k to k + 2 straight, and in line with all differences tied to its ends?
   Allowed are the smoothness and four times the estimated rounding error of the coordinates: the
   greatest of a few errors is seldom below a quarter of another. */
static bool dem2di_chain_straight(const dem2di_chain *chain, int k) {
    int n = chain->count, from = k, last = k + 2, left = n - 3;
    double roundoff = chain->limits.roundoff;
    for (; left > 0 && chain->tied[(from + n - 1) % n]; left--) from = (from + n - 1) % n;
    for (; left > 0 && chain->tied[last]; left--) last = (last + 1) % n;
    dem2d_vec along, sum = chain->d[last], at = dem2di_vec(0, 0);
    for (int i = from; i != last; i = (i + 1) % n) sum = dem2di_add(sum, chain->d[i]);
    if (!dem2di_unit(sum, &along)) return false;
    for (int i = from; i != last; i = (i + 1) % n) {
        dem2d_vec d = chain->d[i];
        double length = dem2di_length(d), slack = dem2di_max(DEM2DI_SMOOTH * length, roundoff);
        at = dem2di_add(at, d);
        if (length > roundoff && (dem2di_dot(d, along) < 0 || fabs(dem2di_cross(d, along)) > slack))
            return false;
        if (fabs(dem2di_cross(at, along)) > 4 * chain->noise) return false;
    }
    return true;
}

/* Tie differences that are too short to have a direction to their neighbours, and straight arcs. */
static void dem2di_chain_tie(dem2di_chain *chain) {
    double roundoff = chain->limits.roundoff;
    dem2di_chain_noise(chain);
    for (int k = 0; k < chain->count; k += 3) {
        const dem2d_vec *d = &chain->d[k];
        chain->tied[k] = dem2di_length(d[0]) <= roundoff || dem2di_length(d[1]) <= roundoff;
        chain->tied[k + 1] = dem2di_length(d[2]) <= roundoff;
    }
    for (int k = 0; k < chain->count; k += 3)
        if (dem2di_chain_straight(chain, k)) chain->tied[k] = chain->tied[k + 1] = true;
}

/* The sum of a group of tied differences from a difference on; *end is the last of the group. */
static dem2d_vec dem2di_chain_sum(const dem2di_chain *chain, int from, int *end) {
    dem2d_vec sum = chain->d[from];
    for (*end = from; chain->tied[*end];) {
        *end = (*end + 1) % chain->count;
        sum = dem2di_add(sum, chain->d[*end]);
    }
    return sum;
}

/* The first difference of a group; -1 if all are tied. */
static int dem2di_chain_first(const dem2di_chain *chain) {
    for (int k = 0; k < chain->count; k++)
        if (!chain->tied[k]) return (k + 1) % chain->count;
    return -1;
}

/* Once around: tie neighbouring groups that turn to the right. True if there was none. */
static bool dem2di_chain_pool(dem2di_chain *chain, int first) {
    int n = chain->count, from = first, last = (first + n - 1) % n;
    bool none = true;
    dem2d_vec sum = dem2di_vec(0, 0), before = chain->d[last];
    for (int k = last; chain->tied[(k + n - 1) % n];) {
        k = (k + n - 1) % n;
        before = dem2di_add(before, chain->d[k]);
    }
    for (int i = 0; i < n; i++) {
        int k = (first + i) % n;
        sum = dem2di_add(sum, chain->d[k]);
        if (chain->tied[k]) continue; /* perhaps by the first group of this round */
        if (dem2di_cross(before, sum) < 0) {
            chain->tied[(from + n - 1) % n] = true;
            none = false;
            sum = dem2di_add(before, sum);
        }
        before = sum;
        sum = dem2di_vec(0, 0);
        from = (k + 1) % n;
    }
    return none;
}

/* Move the points of a group onto its chord. False if a difference is off by more than smooth
   knots and arcs allow at both ends together. */
static bool dem2di_chain_align(dem2di_chain *chain, int from, int *end) {
    int n = chain->count;
    dem2d_vec along, shift = dem2di_vec(0, 0), sum = dem2di_chain_sum(chain, from, end);
    double worst = 0;
    if (!dem2di_unit(sum, &along)) return false;
    for (int k = from, last = 0; !last; k = (k + 1) % n) {
        double length = dem2di_length(chain->d[k]), off = fabs(dem2di_cross(along, chain->d[k]));
        if (off > 4 * DEM2DI_SMOOTH * length + chain->limits.tiny ||
            dem2di_dot(along, chain->d[k]) < -chain->limits.tiny)
            return false;
        if (length > 0) worst = dem2di_max(worst, off / length);
        last = k == *end;
    }
    if (worst <= 4 * DBL_EPSILON) return true; /* already aligned */
    for (int k = from; k != *end; k = (k + 1) % n) {
        dem2d_vec old = chain->d[k];
        chain->d[k] = dem2di_scale(along, dem2di_max(0, dem2di_dot(old, along)));
        shift = dem2di_add(shift, dem2di_sub(chain->d[k], old));
        chain->aligned = dem2di_max(chain->aligned, dem2di_length(shift));
        dem2d_vec *start = &chain->start[(k + 1) % n / 3];
        if ((k + 1) % 3 == 0) *start = dem2di_add(*start, shift);
    }
    chain->d[*end] = dem2di_scale(along, dem2di_max(0, dem2di_dot(chain->d[*end], along)));
    return true;
}

/* Limit of rounds of ties: one is enough for rounding errors of coordinates that are far apart. */
#define DEM2DI_CHAIN_ROUNDS 64

/* Make the control polygon convex and smooth. False if it is not so within the smoothness. */
static bool dem2di_chain_repair(dem2di_chain *chain) {
    int first, end;
    dem2di_chain_tie(chain);
    for (int round = 0;; round++) {
        first = dem2di_chain_first(chain);
        if (first < 0 || round == DEM2DI_CHAIN_ROUNDS) return false;
        if (dem2di_chain_pool(chain, first)) break;
    }
    int from = first;
    do {
        if (!dem2di_chain_align(chain, from, &end)) return false;
        from = (end + 1) % chain->count;
    } while (from != first);
    return true;
}

/* De Casteljau's subdivision at t, in differences. */
static void dem2di_arc_split(const dem2di_arc *arc, double t, dem2di_arc half[2]) {
    double s = 1 - t;
    dem2d_vec a = dem2di_along(dem2di_scale(arc->d0, s), t, arc->d1);
    dem2d_vec b = dem2di_along(dem2di_scale(arc->d1, s), t, arc->d2);
    dem2d_vec middle = dem2di_along(dem2di_scale(a, s), t, b);
    half[0].start = arc->start;
    half[0].d0 = dem2di_scale(arc->d0, t);
    half[0].d1 = dem2di_scale(a, t);
    half[0].d2 = dem2di_scale(middle, t);
    half[1].start = dem2di_add(arc->start, dem2di_arc_chord(&half[0]));
    half[1].d0 = dem2di_scale(middle, s);
    half[1].d1 = dem2di_scale(b, s);
    half[1].d2 = dem2di_scale(arc->d2, s);
}

/* Divide an arc that turns by more than a right angle in two, where it has turned by half. */
static int dem2di_arc_parts(dem2di_chain *chain, const dem2di_arc *arc, dem2di_arc part[2]) {
    dem2d_vec start, end, tangent;
    part[0] = *arc;
    if (!dem2di_arc_tangents(arc, chain->limits.roundoff, &start, &end)) return 1;
    if (dem2di_dot(start, end) >= -DEM2DI_SMOOTH ||
        !dem2di_unit(dem2di_sub(dem2di_perp(start), dem2di_perp(end)), &tangent))
        return 1;
    dem2d_vec u = dem2di_vec(tangent.y, -tangent.x);
    double t = dem2di_arc_parameter(dem2di_dot(arc->d0, u), dem2di_dot(arc->d1, u),
                                    dem2di_dot(arc->d2, u));
    dem2di_arc_split(arc, t, part);
    for (int i = 0; i < 2; i++) { /* a tiny part becomes a corner */
        double length = dem2di_arc_length(&part[i]);
        if (length > chain->limits.tiny) continue;
        dem2d_vec chord = dem2di_arc_chord(&part[i]);
        dem2d_vec *beside = i == 0 ? &part[1].d0 : &part[0].d2;
        *beside = dem2di_add(*beside, chord);
        if (i == 0) part[1].start = part[0].start;
        if (i == 1) part[1].start = dem2di_add(part[1].start, chord);
        part[i].d0 = part[i].d1 = part[i].d2 = dem2di_vec(0, 0);
        chain->parted = dem2di_max(chain->parted, length);
    }
    return 2;
}

/* Keep one of several corners in a row. */
static int dem2di_join_corners(dem2di_arc *part, int count) {
    int kept = 0;
    for (int k = 0; k < count; k++) {
        const dem2di_arc *next = &part[k + 1 < count ? k + 1 : 0];
        if (dem2di_arc_length(&part[k]) > 0 || dem2di_arc_length(next) > 0) part[kept++] = part[k];
    }
    return kept;
}

/* The parts, up to three for each arc: curved arcs, straight arcs, each of greatest length, and
   corners. Returns their number. */
static int dem2di_chain_parts(dem2di_chain *chain, dem2di_arc *part) {
    int arcs = chain->count / 3, first = 0, count = 0;
    const bool *tied = chain->tied;
    /* do not start in the middle of a straight line */
    while (first < arcs && tied[3 * first] && tied[3 * first + 1] &&
           tied[(3 * first + chain->count - 1) % chain->count])
        first++;
    bool goes_on = false;
    for (int i = 0; i < arcs; i++) {
        int k = (first + i) % arcs;
        dem2di_arc arc;
        arc.start = chain->start[k];
        arc.d0 = chain->d[3 * k];
        arc.d1 = chain->d[3 * k + 1];
        arc.d2 = chain->d[3 * k + 2];
        bool straight = tied[3 * k] && tied[3 * k + 1];
        if (straight && goes_on) {
            dem2di_arc *last = &part[count - 1];
            dem2d_vec chord = dem2di_add(dem2di_scale(last->d0, 3), dem2di_arc_chord(&arc));
            last->d0 = last->d1 = last->d2 = dem2di_scale(chord, 1.0 / 3);
        } else if (straight) {
            arc.d0 = arc.d1 = arc.d2 = dem2di_scale(dem2di_arc_chord(&arc), 1.0 / 3);
            part[count++] = arc;
        } else {
            count += dem2di_arc_parts(chain, &arc, &part[count]);
        }
        goes_on = straight && tied[3 * k + 2];
        if (tied[3 * k + 2]) continue;
        memset(&part[count], 0, sizeof *part);
        part[count++].start = chain->start[(k + 1) % arcs];
    }
    return dem2di_join_corners(part, count);
}

/* The parts of checked arcs; `part` has room for three parts of each arc. */
static dem2d_result dem2di_bezier_parts(const dem2d_env *env, const dem2di_arc *given, int count,
                                        dem2di_limits limits, dem2di_arc *part, int *parts,
                                        double *moved) {
    dem2di_chain chain;
    size_t n = (size_t)count, size = 4 * sizeof(dem2d_vec) + 3 * sizeof(bool);
    chain.start = (dem2d_vec *)dem2di_allocate(env, n, size);
    if (chain.start == NULL) return dem2di_fail_memory(env, count, "arcs");
    chain.d = chain.start + n;
    chain.tied = (bool *)(void *)(chain.d + 3 * n);
    chain.limits = limits;
    chain.cornered = chain.aligned = chain.parted = 0;
    bool good = dem2di_chain_set(&chain, given, count) && dem2di_chain_repair(&chain);
    if (good) *parts = dem2di_chain_parts(&chain, part);
    *moved = chain.cornered + chain.aligned + chain.parted;
    dem2di_release(env, chain.start, n, size);
    if (good) return DEM2D_OK;
    return dem2di_fail(env, DEM2D_NOT_CONVEX, -1, "the arcs are not convex within a sine of %g",
                       DEM2DI_SMOOTH);
}

/* Unit tangents at the ends of parts. The part before a straight arc has exactly the same tangent
   as the straight arc, so that no direction selects the straight arc itself. */
static void dem2di_bezier_tangents(dem2d_shape *shape, double roundoff) {
    int n = shape->parts;
    dem2d_vec start, unused;
    for (int k = 0; k < n; k++)
        (void)dem2di_arc_tangents(&shape->arcs[k], roundoff, &start, &shape->tangents[k]);
    for (int k = 0; k < n; k++) {
        int next = (k + 1) % n;
        if (dem2di_arc_straight(&shape->arcs[next]))
            shape->tangents[k] = shape->tangents[next];
        else if (dem2di_arc_length(&shape->arcs[k]) == 0 &&
                 dem2di_arc_tangents(&shape->arcs[next], roundoff, &start, &unused))
            shape->tangents[k] = start;
    }
}

/* Number of full turns of all parts; each part turns by pi at most. */
static int dem2di_bezier_turns(const dem2d_shape *shape) {
    int turns = 0;
    for (int k = 0; k < shape->parts; k++)
        turns += !dem2di_upper(shape->tangents[k]) &&
                 dem2di_upper(shape->tangents[k + 1 < shape->parts ? k + 1 : 0]);
    return turns;
}

/* All fields of a polybezier that follow from its parts. */
static void dem2di_finish_bezier(dem2d_shape *shape) {
    dem2di_arc_bounds bounds;
    bounds.outer = 0;
    bounds.inner = bounds.rho = HUGE_VAL;
    bounds.attained[0] = 0;
    bounds.attained[1] = bounds.attained[2] = HUGE_VAL;
    /* 1e-9 of the size is below the tolerance of any contact; 40 halvings are enough for doubles */
    bounds.tolerance = 1e-9 * sqrt(shape->mass.area);
    for (int k = 0; k < shape->parts; k++) dem2di_bound_arc(&bounds, &shape->arcs[k], 40);
    shape->circumscribed = bounds.outer + shape->deviation;
    shape->inscribed = dem2di_max(0, bounds.inner - shape->deviation);
    shape->rho_min = dem2di_finite(bounds.rho) ? bounds.rho : 0;
    shape->rho_max = 0;
    for (int k = 0; k < DEM2DI_RHO_SECTORS; k++) shape->least_rho[k] = HUGE_VAL;
    for (int k = 0; k < shape->parts; k++) {
        dem2d_vec before = shape->tangents[(k + shape->parts - 1) % shape->parts];
        const dem2di_arc *arc = &shape->arcs[k];
        if (dem2di_arc_straight(arc)) continue;
        if (dem2di_arc_length(arc) > 0) {
            dem2di_arc_least_rho(shape, arc, 12);
            shape->rho_max = dem2di_arc_rho_max(arc, shape->rho_max);
        } else {
            dem2di_least_rho_lower(shape, before, shape->tangents[k], 0);
        }
    }
    for (int k = 0; k < DEM2DI_RHO_SECTORS; k++) /* sectors without an arc */
        if (!dem2di_finite(shape->least_rho[k])) shape->least_rho[k] = shape->rho_min;
    dem2di_least_rho_join(shape);
    dem2di_fill_sectors(shape);
    dem2di_find_edges(shape);
}

/* Move arcs so that their centroid is the origin; offset gets the old centroid. */
static dem2d_mass dem2di_bezier_centre(dem2di_arc *arcs, int count, dem2d_vec *offset) {
    dem2d_mass mass;
    *offset = dem2di_vec(0, 0);
    for (int pass = 0; pass < 2; pass++) { /* the second pass gives moments about the centroid */
        mass = dem2di_bezier_mass(arcs, count);
        for (int k = 0; k < count; k++) arcs[k].start = dem2di_sub(arcs[k].start, mass.centroid);
        *offset = dem2di_add(*offset, mass.centroid);
    }
    mass.centroid = dem2di_vec(0, 0);
    return mass;
}

/* A polybezier of checked arcs; `work` has room for three parts of each arc. */
static dem2d_result dem2di_bezier_make(const dem2d_env *env, dem2di_arc *arcs, int count,
                                       dem2di_limits limits, dem2di_arc *work,
                                       dem2d_shape **shape) {
    int parts = 0;
    double moved = 0;
    dem2d_vec offset;
    dem2d_mass mass = dem2di_bezier_centre(arcs, count, &offset);
    dem2d_result result = dem2di_bezier_parts(env, arcs, count, limits, work, &parts, &moved);
    if (result != DEM2D_OK) return result;
    dem2d_shape *made = dem2di_shape_allocate(env, DEM2D_BEZIER, count, parts);
    if (made == NULL) return DEM2D_OUT_OF_MEMORY;
    memcpy(made->given, arcs, (size_t)count * sizeof *arcs);
    memcpy(made->arcs, work, (size_t)parts * sizeof *work);
    made->offset = offset;
    made->mass = mass;
    made->deviation = moved;
    dem2di_bezier_tangents(made, limits.roundoff);
    if (dem2di_bezier_turns(made) != 1) {
        dem2d_shape_destroy(made);
        return dem2di_fail(env, DEM2D_NOT_CONVEX, -1, "the arcs do not make exactly one turn");
    }
    dem2di_finish_bezier(made);
    return dem2di_shape_finish(made, shape);
}

/* Indices go up to twice around three parts for each arc: that is half of INT_MAX. */
#define DEM2DI_MAX_ARCS (INT_MAX / 12)

DEM2D_API dem2d_result dem2d_shape_create_bezier(const dem2d_env *env, const dem2d_vec *control,
                                                 int arcs, dem2d_shape **shape) {
    if (shape == NULL) return dem2di_fail_null(env, "shape");
    if (arcs < 2) return dem2di_fail(env, DEM2D_TOO_FEW_POINTS, -1, "arcs = %d, 2 needed", arcs);
    dem2d_result result = dem2di_check_number(env, "arcs", arcs, DEM2DI_WHOLE(2, DEM2DI_MAX_ARCS));
    if (result == DEM2D_OK) result = dem2di_check_points(env, "control", control, 3 * arcs, 6);
    if (result != DEM2D_OK) return result;
    double area = 0, size = dem2di_coordinate_size(control, 3 * arcs), extent = 0;
    for (int i = 0; i < 3 * arcs; i++)
        extent = dem2di_max(extent, dem2di_length(dem2di_sub(control[i], control[0])));
    area = dem2di_twice_area(control, 3 * arcs);
    if (fabs(area) <= 8 * DBL_EPSILON * size * extent)
        return dem2di_fail(env, DEM2D_ZERO_AREA, -1, "the control polygon's area is %g", area / 2);
    dem2di_limits limits;
    limits.roundoff = 8 * DBL_EPSILON * size;
    limits.tiny = dem2di_max(DEM2DI_TINY * extent, 4 * limits.roundoff); /* has a direction */
    size_t n = (size_t)arcs, each = 4 * sizeof(dem2di_arc); /* an arc, and room for three parts */
    dem2di_arc *work = (dem2di_arc *)dem2di_allocate(env, n, each);
    if (work == NULL) return dem2di_fail_memory(env, arcs, "arcs");
    dem2di_arcs_from_control(control, arcs, area < 0, work);
    result = dem2di_check_arcs(env, work, arcs, area < 0, limits);
    if (result == DEM2D_OK) result = dem2di_bezier_make(env, work, arcs, limits, work + n, shape);
    dem2di_release(env, work, n, each);
    return result;
}

/* Rounding error of rho of a series, relative to the sum of its terms: its bound is found to 2e-14,
   and term n has about n rounding errors. */
#define DEM2DI_SERIES_TOLERANCE 2e-14
#define DEM2DI_SERIES_ROUNDOFF 6e-14

/* Of a Fourier series. */
#define DEM2DI_ORDER DEM2DI_WHOLE(0, 1 << 20)

static dem2d_result dem2di_check_series(const dem2d_env *env, const double *a, const double *b,
                                        int order) {
    if (a == NULL) return dem2di_fail_null(env, "a");
    if (b == NULL) return dem2di_fail_null(env, "b");
    dem2d_result result = dem2di_check_number(env, "order", order, DEM2DI_ORDER);
    if (result != DEM2D_OK) return result;
    for (int n = 0; n <= order; n++) {
        if (!dem2di_finite(a[n]))
            return dem2di_fail(env, DEM2D_NOT_FINITE, n, "a[%d] = %g is not finite", n, a[n]);
        if (n > 0 && !dem2di_finite(b[n]))
            return dem2di_fail(env, DEM2D_NOT_FINITE, n, "b[%d] = %g is not finite", n, b[n]);
    }
    if (!(a[0] > 0)) return dem2di_fail(env, DEM2D_ZERO_AREA, 0, "a[0] = %g", a[0]);
    return DEM2D_OK;
}

static dem2d_convexity dem2di_convexity(const double *a, const double *b, int order) {
    dem2di_series radius = dem2di_series_make(a, b, order, true, 1);
    dem2di_bounds rho = dem2di_series_minimum(&radius, DEM2DI_SERIES_TOLERANCE * radius.size);
    dem2d_convexity convexity;
    convexity.sufficient_margin = a[0] - radius.size; /* size holds a0/2 once */
    convexity.sufficient = convexity.sufficient_margin >= 0;
    convexity.rho_min_lower = rho.lower;
    convexity.rho_min_upper = rho.upper;
    convexity.exact = rho.lower >= -DEM2DI_SERIES_ROUNDOFF * radius.size;
    return convexity;
}

/* Lower bound of rho in each sector, by Taylor's formula in each quarter of it. */
static void dem2di_fourier_least_rho(dem2d_shape *shape, const double *a, const double *b) {
    dem2di_series radius = dem2di_series_make(a, b, shape->count, true, 1);
    double roundoff = DEM2DI_SERIES_ROUNDOFF * radius.size, d[3];
    for (int k = 0; k < 4 * DEM2DI_RHO_SECTORS; k++) {
        dem2d_vec u = dem2di_sector_start(2 * k + 1, 8 * DEM2DI_RHO_SECTORS);
        dem2d_vec v = dem2di_sector_start(2 * k, 8 * DEM2DI_RHO_SECTORS);
        dem2d_vec w =
            dem2di_sector_start((2 * k + 2) % (8 * DEM2DI_RHO_SECTORS), 8 * DEM2DI_RHO_SECTORS);
        /* tangents of the half angles: upper bounds of the half angles */
        double half = dem2di_max(dem2di_cross(v, u) / dem2di_dot(v, u),
                                 dem2di_cross(u, w) / dem2di_dot(u, w));
        double value = dem2di_series_value(&radius, dem2d_rot_angle(dem2di_rot(u)), d);
        double least = dem2di_taylor_bound(&radius, value, d, half) - roundoff;
        double *sector = &shape->least_rho[k / 4];
        if (k % 4 == 0) *sector = HUGE_VAL;
        *sector = dem2di_min(*sector, dem2di_max(least, shape->rho_min));
    }
    dem2di_least_rho_join(shape);
}

/* The terms of order n. */
static void dem2di_fourier_term(dem2d_shape *shape, int n, double a, double b) {
    dem2di_block *block = &shape->blocks[(n - 1) / 4];
    int j = (n - 1) % 4;
    block->a[j] = a;
    block->b[j] = b;
    block->na[j] = n * a;
    block->nb[j] = n * b;
    block->square[j] = (double)n * n;
}

/* All fields of an FS shape that follow from its coefficients a, b about the centroid. */
static void dem2di_finish_fourier(dem2d_shape *shape, const double *a, const double *b,
                                  double rho_min) {
    int order = shape->count;
    shape->a = a[0] / 2;
    for (int n = 1; n <= order; n++) dem2di_fourier_term(shape, n, a[n], b[n]);
    /* the greatest support value is the circumscribed radius, the least the inscribed one */
    dem2di_series p = dem2di_series_make(a, b, order, false, 1);
    dem2di_series minus = dem2di_series_make(a, b, order, false, -1);
    shape->circumscribed = -dem2di_series_minimum(&minus, 1e-12 * p.size).lower;
    shape->inscribed = dem2di_max(0, dem2di_series_minimum(&p, 1e-12 * p.size).lower);
    shape->rho_min = dem2di_max(0, rho_min);
    dem2di_series flat = dem2di_series_make(a, b, order, true, -1);
    shape->rho_max = -dem2di_series_minimum(&flat, 1e-9 * flat.size).lower;
    dem2di_fourier_least_rho(shape, a, b);
}

DEM2D_API dem2d_result dem2d_shape_create_fourier(const dem2d_env *env, const double *a,
                                                  const double *b, int order, dem2d_shape **shape) {
    if (shape == NULL) return dem2di_fail_null(env, "shape");
    dem2d_result result = dem2di_check_series(env, a, b, order);
    if (result != DEM2D_OK) return result;
    dem2d_convexity convexity = dem2di_convexity(a, b, order);
    if (!convexity.exact)
        return dem2di_fail(env, DEM2D_NEGATIVE_CURVATURE, -1, "the least radius of curvature is %g",
                           convexity.rho_min_lower);
    /* a1, b1 move the shape: the copy has at least order 1, so that it can be recentred */
    int terms = order > 1 ? order + 1 : 2;
    double *copy = (double *)dem2di_allocate(env, (size_t)terms, 2 * sizeof *copy);
    if (copy == NULL) return dem2di_fail_memory(env, order, "terms");
    double *ca = copy, *cb = copy + terms;
    for (int n = 0; n < terms; n++) {
        ca[n] = n <= order ? a[n] : 0;
        cb[n] = n <= order && n > 0 ? b[n] : 0;
    }
    dem2d_shape *made = dem2di_shape_allocate(env, DEM2D_FOURIER, order, 0);
    if (made != NULL) {
        made->offset = dem2di_vec(ca[1], cb[1]); /* the Steiner point */
        ca[1] = cb[1] = 0;
        for (int pass = 0; pass < 2; pass++) { /* the second gives moments about the centroid */
            made->mass = dem2di_fourier_mass(ca, cb, terms - 1);
            ca[1] -= made->mass.centroid.x;
            cb[1] -= made->mass.centroid.y;
            made->offset = dem2di_add(made->offset, made->mass.centroid);
        }
        made->mass.centroid = dem2di_vec(0, 0);
        dem2di_finish_fourier(made, ca, cb, convexity.rho_min_lower);
        result = dem2di_shape_finish(made, shape);
    } else {
        result = DEM2D_OUT_OF_MEMORY;
    }
    dem2di_release(env, copy, (size_t)terms, 2 * sizeof *copy);
    return result;
}

static const dem2di_field dem2di_custom_fields[] = {
    DEM2DI_ROW(dem2d_custom_desc, support, DEM2DI_REQUIRED, "- none"),
    DEM2DI_ROW(dem2d_custom_desc, user, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_custom_desc, rho_min, DEM2DI_FROM_0, "m 0"),
    DEM2DI_ROW(dem2d_custom_desc, inscribed, DEM2DI_FROM_0, "m 0"),
    DEM2DI_ROW(dem2d_custom_desc, mass.area, DEM2DI_FROM_0, "m2 computed; 0: from outline_points"),
    DEM2DI_ROW(dem2d_custom_desc, mass.centroid, DEM2DI_VECTOR, "m computed"),
    DEM2DI_ROW(dem2d_custom_desc, mass.polar_moment, DEM2DI_FROM_0,
               "m4 computed; > 0 with an area"),
    DEM2DI_ROW(dem2d_custom_desc, outline_points, DEM2DI_WHOLE_OR_0(3, DBL_MAX), "- 1000"),
    DEM2DI_ROW(dem2d_custom_desc, tag, DEM2DI_TAG, "- 0"),
};

DEM2D_API dem2d_result dem2d_shape_create_custom(const dem2d_env *env,
                                                 const dem2d_custom_desc *desc,
                                                 dem2d_shape **shape) {
    if (shape == NULL) return dem2di_fail_null(env, "shape");
    if (desc == NULL) return dem2di_fail_null(env, "desc");
    dem2d_result result = dem2di_check_fields(env, DEM2DI_ALL(dem2di_custom_fields), desc);
    if (result == DEM2D_OK && desc->mass.area > 0)
        result =
            dem2di_check_number(env, "mass.polar_moment", desc->mass.polar_moment, DEM2DI_POSITIVE);
    if (result != DEM2D_OK) return result;
    int points = desc->outline_points == 0 ? 1000 : desc->outline_points;
    dem2d_shape *made = dem2di_shape_allocate(env, DEM2D_CUSTOM, 0, 0);
    if (made == NULL) return DEM2D_OUT_OF_MEMORY;
    made->function = desc->support;
    made->function_user = desc->user;
    made->function_tag = desc->tag;
    made->mass = desc->mass.area > 0 ? desc->mass : dem2di_mass_interpolated(made, points);
    made->offset = made->mass.centroid;
    made->mass.centroid = dem2di_vec(0, 0);
    /* the circle around the box of the four supports */
    double x = dem2di_max(dem2di_half_width(made, 1, 0), dem2di_half_width(made, -1, 0));
    double y = dem2di_max(dem2di_half_width(made, 0, 1), dem2di_half_width(made, 0, -1));
    made->circumscribed = sqrt(x * x + y * y);
    made->inscribed = dem2di_min(desc->inscribed, dem2di_min(x, y));
    made->rho_min = desc->rho_min;
    if (!dem2di_finite(made->mass.area))
        result = dem2di_fail(env, DEM2D_NOT_FINITE, -1,
                             "the support function gives points that are not finite");
    else if (!(made->mass.area > 0 && made->mass.polar_moment > 0 && x > 0 && y > 0))
        result = dem2di_fail(env, DEM2D_ZERO_AREA, -1, "the support function gives an area of %g",
                             made->mass.area);
    if (result != DEM2D_OK) {
        dem2d_shape_destroy(made);
        return result;
    }
    *shape = made;
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_shape_get(const dem2d_shape *shape, dem2d_shape_info *info) {
    if (shape == NULL || info == NULL) return DEM2D_NULL_ARGUMENT;
    info->type = shape->type;
    info->count = shape->count;
    info->rounding = shape->rounding;
    info->mass = shape->mass;
    info->offset = shape->offset;
    info->circumscribed = shape->circumscribed;
    info->inscribed = shape->inscribed;
    info->rho_min = shape->rho_min;
    info->rho_max = shape->rho_max;
    info->deviation = shape->deviation;
    info->equivalent = sqrt(shape->mass.area / DEM2DI_PI);
    info->bytes = shape->bytes;
    return DEM2D_OK;
}

/* Is (x, y) a unit vector within rounding errors? It is then not normalised again, so that exact
   rotations stay exact. */
static bool dem2di_is_unit(double x, double y) {
    return fabs(x * x + y * y - 1) <= 4 * DBL_EPSILON;
}

/* Check a caller's pose (finite, rotation not zero, scale above 0) and normalise its rotation. */
static dem2d_result dem2di_check_pose(dem2d_pose *pose) {
    dem2d_vec rotation = dem2di_vec(pose->rotation.c, pose->rotation.s);
    if (!dem2di_vec_finite(pose->position) || !dem2di_vec_finite(rotation) ||
        !dem2di_finite(pose->scale))
        return DEM2D_NOT_FINITE;
    if (!(pose->scale > 0)) return DEM2D_OUT_OF_RANGE;
    if (dem2di_is_unit(rotation.x, rotation.y)) return DEM2D_OK;
    if (!dem2di_unit(rotation, &rotation)) return DEM2D_OUT_OF_RANGE;
    pose->rotation.c = rotation.x;
    pose->rotation.s = rotation.y;
    return DEM2D_OK;
}

/* A point of a template at a pose, relative to the pose's position. */
static dem2d_vec dem2di_at_pose(const dem2d_pose *pose, dem2d_vec s) {
    return dem2di_scale(dem2di_turn(pose->rotation, s), pose->scale);
}

/* Do the parts for contacts differ from the caller's arcs by more than rounding errors? */
static bool dem2di_deviates(const dem2d_shape *shape) {
    return shape->deviation > DEM2DI_ROUNDOFF * shape->circumscribed;
}

/* Parameters where an arc of any form may have its extreme along a direction: 0, up to two zeros of
   the derivative in order, and 1. Returns their number. */
static int dem2di_arc_extrema(const dem2di_arc *arc, dem2d_vec u, double t[4]) {
    double q0 = dem2di_dot(arc->d0, u), q1 = dem2di_dot(arc->d1, u), q2 = dem2di_dot(arc->d2, u);
    double square = q1 * q1 - q0 * q2, root = square > 0 ? sqrt(square) : 0;
    double sum = q1 > 0 ? q1 + root : q1 - root;  /* nothing cancels */
    double part[2][2] = {{sum, -q2}, {q0, -sum}}; /* t : 1 - t for both roots */
    int count = 1;
    t[0] = 0;
    for (int i = 0; i < 2 && square > 0; i++) {
        double at = part[i][0] / (part[i][0] + part[i][1]);
        if (at > 0 && at < 1) t[count++] = at;
    }
    if (count == 3 && t[1] > t[2]) {
        double first = t[2];
        t[2] = t[1];
        t[1] = first;
    }
    t[count++] = 1;
    return count;
}

/* Support point of the caller's arcs; all of them are evaluated if the parts differ from them. */
static dem2d_vec dem2di_given_support(const dem2d_shape *shape, dem2d_vec u, double *rho) {
    dem2d_vec best = dem2di_support(shape, u, rho);
    if (!dem2di_deviates(shape)) return best;
    double most = -HUGE_VAL;
    for (int k = 0; k < shape->count; k++) {
        double t[4];
        for (int i = dem2di_arc_extrema(&shape->given[k], u, t) - 1; i >= 0; i--) {
            dem2d_vec point = dem2di_arc_point(&shape->given[k], t[i]);
            if (dem2di_dot(point, u) <= most) continue;
            most = dem2di_dot(point, u);
            best = point;
        }
    }
    return best;
}

/* The same at a pose, relative to its position. */
static dem2d_vec dem2di_posed_given(const dem2d_shape *shape, const dem2d_pose *pose, dem2d_vec u,
                                    double *rho) {
    dem2d_vec s = dem2di_given_support(shape, dem2di_turn_back(pose->rotation, u), rho);
    if (rho != NULL) *rho *= pose->scale;
    return dem2di_at_pose(pose, s);
}

/* From a point on the parts with the normal u, along u to the hull of the caller's arcs: the
   segment between two support points, of directions on both sides of u, which are halved until only
   rounding errors are left. If no point of the hull is along u (beside a corner), the nearest
   support point. */
static dem2d_vec dem2di_given_point(const dem2d_shape *shape, dem2d_vec u, dem2d_vec point) {
    double place = dem2di_cross(u, point), at[2];
    dem2d_vec end[2], s[2], v;
    int beyond = 0;
    if (!dem2di_deviates(shape)) return point;
    for (double angle = 4 * DEM2DI_SMOOTH; angle < 1; angle *= 8) {
        for (int i = 0; i < 2; i++) {
            dem2d_vec turned = dem2di_along(u, i == 0 ? -angle : angle, dem2di_perp(u));
            end[i] = dem2di_unit(turned, &v) ? v : u;
            s[i] = dem2di_given_support(shape, end[i], NULL);
            at[i] = dem2di_cross(u, s[i]);
        }
        beyond = (place > at[1]) - (place < at[0]);
        if (beyond == 0) break;
    }
    if (beyond != 0) return s[beyond > 0];
    /* 60 halvings reach rounding errors */
    for (int i = 0; i < 60 && dem2di_cross(end[0], end[1]) > 2 * DBL_EPSILON; i++) {
        if (!dem2di_unit(dem2di_add(end[0], end[1]), &v)) break;
        dem2d_vec middle = dem2di_given_support(shape, v, NULL);
        int side = dem2di_cross(u, middle) >= place;
        end[side] = v;
        s[side] = middle;
        at[side] = dem2di_cross(u, middle);
    }
    double t = at[1] > at[0] ? (place - at[0]) / (at[1] - at[0]) : 0;
    return dem2di_along(s[0], t, dem2di_sub(s[1], s[0]));
}

DEM2D_API dem2d_result dem2d_shape_support(const dem2d_shape *shape, dem2d_pose pose,
                                           dem2d_vec direction, dem2d_support *support) {
    if (shape == NULL || support == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_pose(&pose);
    if (result != DEM2D_OK) return result;
    if (!dem2di_vec_finite(direction)) return DEM2D_NOT_FINITE;
    dem2d_vec u;
    if (!dem2di_unit(direction, &u)) return DEM2D_OUT_OF_RANGE;
    dem2d_vec s = dem2di_posed_given(shape, &pose, u, &support->rho);
    support->direction = u;
    support->value = dem2di_dot(s, u);
    support->point = dem2di_add(pose.position, s);
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_shape_aabb(const dem2d_shape *shape, dem2d_pose pose, dem2d_box *box) {
    if (shape == NULL || box == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_pose(&pose);
    if (result != DEM2D_OK) return result;
    double extent[4]; /* along +x, +y, -x, -y */
    dem2d_vec u = dem2di_vec(1, 0);
    for (int i = 0; i < 4; i++) {
        extent[i] = dem2di_dot(dem2di_posed_given(shape, &pose, u, NULL), u);
        u = dem2di_perp(u);
    }
    box->lower = dem2di_vec(pose.position.x - extent[2], pose.position.y - extent[3]);
    box->upper = dem2di_vec(pose.position.x + extent[0], pose.position.y + extent[1]);
    return DEM2D_OK;
}

/* A point of a template at a pose. */
static dem2d_vec dem2di_place(const dem2d_pose *pose, dem2d_vec point) {
    return dem2di_along(pose->position, pose->scale, dem2di_turn(pose->rotation, point));
}

DEM2D_API dem2d_result dem2d_shape_outline(const dem2d_shape *shape, dem2d_pose pose, int count,
                                           dem2d_vec *points) {
    if (shape == NULL || points == NULL) return DEM2D_NULL_ARGUMENT;
    if (count < 3) return DEM2D_TOO_FEW_POINTS;
    dem2d_result result = dem2di_check_pose(&pose);
    if (result != DEM2D_OK) return result;
    for (int i = 0; i < count; i++)
        points[i] = dem2di_place(&pose, dem2di_outline_point(shape, i, count));
    return DEM2D_OK;
}

/* Relative area that an outline polygon may lack where it represents a shape: no part of the area
   then has a greater error. The points are doubled until that holds; their limit is for custom
   shapes, whose area the caller may give. */
#define DEM2DI_OUTLINE_DEFECT 1e-5
#define DEM2DI_OUTLINE_CAP 65536

/* A multiple of the number of corners or arcs, so that regular shapes have regular polygons. */
static int dem2di_fine_count(const dem2d_shape *shape) {
    int parts = shape->count > 0 ? shape->count : 1;
    if (shape->type == DEM2D_POLYGON && shape->rounding == 0) return parts;
    int points = parts > 128 ? 2 * parts : (255 / parts + 1) * parts;
    double least = (1 - DEM2DI_OUTLINE_DEFECT) * shape->mass.area;
    while (points < DEM2DI_OUTLINE_CAP && dem2di_mass_interpolated(shape, points).area < least)
        points *= 2;
    return points;
}

/* Second moments of area about the centroid, in axes turned by q. Along its own axes the width of a
   needle keeps its digits: the sums of the two directions are never added. A triangle of the
   centroid, a and b has area / 12 ((a + b)(a + b) + aa + bb). */
static void dem2di_second_triangle(dem2di_tensor *sum, dem2d_vec a, dem2d_vec b) {
    double sixth = dem2di_cross(a, b) / 12; /* a sixth of the triangle's area */
    dem2di_tensor_add(sum, sixth, a, a);
    dem2di_tensor_add(sum, sixth, a, b);
    dem2di_tensor_add(sum, sixth, b, b);
}

/* Of the polygon through outline points, which is exact for sharp polygons. */
static dem2di_tensor dem2di_second_polygon(const dem2d_shape *shape, int points, dem2d_rot q) {
    dem2di_tensor sum = {0, 0, 0};
    dem2d_vec a = dem2di_turn_back(q, dem2di_outline_point(shape, 0, points));
    for (int i = 1; i <= points; i++) {
        dem2d_vec b = dem2di_turn_back(q, dem2di_outline_point(shape, i % points, points));
        dem2di_second_triangle(&sum, a, b);
        a = b;
    }
    return sum;
}

/* Of the circular sector at a corner: apex c, radius r, first direction `in`, an angle. About its
   apex it has r^4/8 (angle + sin angle) along its bisector w, r^4/8 (angle - sin angle) across, and
   the first moment 2/3 r^3 sin(angle/2) w. */
static void dem2di_second_sector(dem2di_tensor *sum, dem2d_vec c, double r, dem2d_vec in,
                                 double angle) {
    dem2d_rot half = dem2d_rot_make(angle / 2);
    dem2d_vec w = dem2di_turn(half, in), across = dem2di_perp(w);
    double fourth = r * r * r * r / 8, sine = 2 * half.s * half.c;
    dem2di_tensor_add(sum, r * r * angle / 2, c, c);
    dem2di_tensor_add(sum, 4 * r * r * r * half.s / 3, c, w);
    dem2di_tensor_add(sum, fourth * (angle + sine), w, w);
    dem2di_tensor_add(sum, fourth * (angle - sine), across, across);
}

/* Of a rounded polygon: the polygon of its corners, a rectangle on each edge, a sector at each
   corner. */
static dem2di_tensor dem2di_second_rounded(const dem2d_shape *shape, dem2d_rot q) {
    dem2di_tensor sum = {0, 0, 0};
    double r = shape->rounding;
    int n = shape->count;
    for (int k = 0; k < n; k++) {
        dem2d_vec a = dem2di_turn_back(q, shape->corners[k]);
        dem2d_vec b = dem2di_turn_back(q, shape->corners[(k + 1) % n]);
        dem2d_vec last = dem2di_turn_back(q, shape->corners[(k + n - 1) % n]);
        dem2d_vec edge = dem2di_sub(b, a), before = dem2di_sub(a, last), normal, in;
        (void)dem2di_unit(dem2di_right(edge), &normal);
        (void)dem2di_unit(dem2di_right(before), &in);
        dem2d_vec middle = dem2di_along(dem2di_along(a, 0.5, edge), r / 2, normal);
        double area = dem2di_length(edge) * r;
        dem2di_second_triangle(&sum, a, b);
        dem2di_tensor_add(&sum, area, middle, middle);
        dem2di_tensor_add(&sum, area / 12, edge, edge);
        dem2di_tensor_add(&sum, area * r * r / 12, normal, normal);
        dem2di_second_sector(&sum, a, r, in, dem2di_angle(before, edge));
    }
    return sum;
}

/* Of a polybezier: 1/4 int ss (s x ds) has degree 11 in an arc's parameter, six points are
   exact. */
static dem2di_tensor dem2di_second_bezier(const dem2d_shape *shape, dem2d_rot q) {
    dem2di_tensor sum = {0, 0, 0};
    for (int k = 0; k < shape->count; k++)
        for (int i = 0; i < 6; i++) {
            double weight, t = dem2di_gauss_point(i, &weight);
            dem2d_vec p = dem2di_turn_back(q, dem2di_arc_point(&shape->given[k], t));
            dem2d_vec v = dem2di_turn_back(q, dem2di_arc_speed(&shape->given[k], t));
            dem2di_tensor_add(&sum, 1.5 * weight * dem2di_cross(p, v) / 4, p, p);
        }
    return sum;
}

/* Of an FS: 1/4 int ss h rho dt has degree 4N + 2, more points than that are exact. */
static dem2di_tensor dem2di_second_fourier(const dem2d_shape *shape, dem2d_rot q) {
    dem2di_tensor sum = {0, 0, 0};
    int points = 4 * shape->count + 8;
    for (int i = 0; i < points; i++) {
        dem2d_vec u = dem2di_direction(i, points);
        double rho, weight = 2 * DEM2DI_PI / points / 4;
        dem2d_vec s = dem2di_support(shape, u, &rho), turned = dem2di_turn_back(q, s);
        dem2di_tensor_add(&sum, weight * dem2di_dot(s, u) * rho, turned, turned);
    }
    return sum;
}

/* Of any template but circles and ellipses; *terms is the number of summands, for rounding
   errors. */
static dem2di_tensor dem2di_second_moments(const dem2d_shape *shape, dem2d_rot q, int *terms) {
    *terms = shape->count;
    if (shape->type == DEM2D_BEZIER) return dem2di_second_bezier(shape, q);
    if (shape->type == DEM2D_FOURIER) return dem2di_second_fourier(shape, q);
    if (shape->rounding > 0) return dem2di_second_rounded(shape, q);
    *terms = dem2di_fine_count(shape);
    return dem2di_second_polygon(shape, *terms, q);
}

/* The long axis, in (-pi/2, pi/2], and the ratio of the radii of gyration; 0 and 1 if the moments
   differ only by rounding errors. The moments are computed again in the axes found: the tensor is
   then nearly diagonal, its axis is a small correction, and a needle's width keeps its digits. */
static double dem2di_axis(const dem2d_shape *shape, double *ratio) {
    int terms;
    *ratio = 1;
    if (shape->type == DEM2D_CIRCLE) return 0;
    if (shape->type == DEM2D_ELLIPSE) { /* a and b are squares */
        bool wide = shape->a >= shape->b;
        *ratio = sqrt(wide ? shape->a / shape->b : shape->b / shape->a);
        return wide ? 0 : DEM2DI_PI / 2;
    }
    dem2di_tensor sum = dem2di_second_moments(shape, dem2d_rot_make(0), &terms);
    dem2d_principal principal = dem2di_tensor_principal(sum);
    if (!(principal.q > (terms + 256) * DBL_EPSILON * principal.p)) return 0;
    sum = dem2di_second_moments(shape, dem2d_rot_make(principal.angle), &terms);
    dem2d_principal rest = dem2di_tensor_principal(sum);
    double least = sum.yy - sum.xy * (sum.xy / (sum.xx - sum.yy)); /* to the fourth order in xy */
    *ratio = sqrt((rest.p + rest.q) / least);
    double angle = principal.angle + rest.angle;
    if (angle > DEM2DI_PI / 2) angle -= DEM2DI_PI;
    return angle > -DEM2DI_PI / 2 ? angle : angle + DEM2DI_PI;
}

DEM2D_API dem2d_result dem2d_shape_axis(const dem2d_shape *shape, double *angle, double *ratio) {
    if (shape == NULL || angle == NULL || ratio == NULL) return DEM2D_NULL_ARGUMENT;
    *angle = dem2di_axis(shape, ratio);
    return DEM2D_OK;
}

/* ============================================================================================
   >>outlines  Outlines from pixels, and their measures
   uses: config, math, memory, fields, hull, mass
   ============================================================================================ */

#define DEM2DI_PICTURE_SIDE 32768 /* 2^15 squared pixels: their number stays an int */
#define DEM2DI_MIN_PIXELS 16      /* four by four: smaller outlines show the pixels, not a shape */

/* Marks of a pixel: its left or right side is part of a kept grain's outer boundary; it belongs to
   a component that was found before. */
#define DEM2DI_ENTRY 1
#define DEM2DI_EXIT 2
#define DEM2DI_MARKED 4

struct dem2d_outline_set {
    dem2d_env env;
    dem2d_outline *grains; /* capacity, count of them used */
    int count, capacity;
    dem2d_vec *points; /* point_count, of all grains one after the other */
    size_t point_count;
};

/* A region of a checked picture, with defaults filled in. Pixels with values from low to high are
   selected: those of one grain, of all grains, or of a frame. */
typedef struct dem2di_picture {
    dem2d_image_desc desc; /* pixels, width and height are the region's */
    int low, high;
    dem2d_vec corner; /* px, of the region's lower left corner in the whole picture */
    uint8_t *marks;   /* one for each pixel, or NULL */
    int *stack;       /* capacity; of a flood fill */
    int capacity;
} dem2di_picture;

static int dem2di_picture_levels(const dem2d_image_desc *desc) {
    return desc->pixels16 != NULL ? 65536 : 256;
}

static const dem2di_field dem2di_picture_fields[] = {
    DEM2DI_ROW(dem2d_image_desc, pixels, DEM2DI_OPTIONAL, "- none; required, or pixels16"),
    DEM2DI_ROW(dem2d_image_desc, pixels16, DEM2DI_OPTIONAL, "- none; not with pixels"),
    DEM2DI_ROW(dem2d_image_desc, width, DEM2DI_WHOLE(1, DEM2DI_PICTURE_SIDE), "px none"),
    DEM2DI_ROW(dem2d_image_desc, height, DEM2DI_WHOLE(1, DEM2DI_PICTURE_SIDE), "px none"),
    DEM2DI_ROW(dem2d_image_desc, stride, DEM2DI_COUNT, "- width; not below the width"),
    DEM2DI_ROW(dem2d_image_desc, crop_left, DEM2DI_COUNT, "px 0; below the width"),
    DEM2DI_ROW(dem2d_image_desc, crop_top, DEM2DI_COUNT, "px 0; below the height"),
    DEM2DI_ROW(dem2d_image_desc, crop_width, DEM2DI_COUNT, "px the rest; within the width"),
    DEM2DI_ROW(dem2d_image_desc, crop_height, DEM2DI_COUNT, "px the rest; within the height"),
};

/* Of a picture of which outlines are taken. */
static const dem2di_field dem2di_search_fields[] = {
    DEM2DI_ROW(dem2d_image_desc, labels, DEM2DI_SWITCH, "- false; without the next three"),
    DEM2DI_ROW(dem2d_image_desc, threshold, DEM2DI_WHOLE(0, 65535), "- Otsu; to 255 for pixels"),
    DEM2DI_ROW(dem2d_image_desc, ignore_frame, DEM2DI_SWITCH, "- false; without a threshold"),
    DEM2DI_ROW(dem2d_image_desc, bright, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_image_desc, min_pixels, DEM2DI_COUNT, "- 16"),
    DEM2DI_ROW(dem2d_image_desc, max_pixels, DEM2DI_COUNT, "- no limit"),
    DEM2DI_ROW(dem2d_image_desc, keep_border, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_image_desc, scale, DEM2DI_POSITIVE, "m/px none"),
};

static dem2d_result dem2di_check_picture(const dem2d_env *env, const dem2d_image_desc *desc) {
    if (desc == NULL || (desc->pixels == NULL && desc->pixels16 == NULL))
        return dem2di_fail_null(env, "desc or pixels");
    if (desc->pixels != NULL && desc->pixels16 != NULL)
        return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "pixels and pixels16: one of the two");
    int width = desc->width, height = desc->height, left = desc->crop_left, top = desc->crop_top;
    dem2d_result result = dem2di_check_fields(env, DEM2DI_ALL(dem2di_picture_fields), desc);
    if (result == DEM2D_OK)
        result =
            dem2di_check_number(env, "stride", desc->stride, DEM2DI_WHOLE_OR_0(width, DBL_MAX));
    if (result == DEM2D_OK)
        result = dem2di_check_number(env, "crop_left", left, DEM2DI_WHOLE(0, width - 1));
    if (result == DEM2D_OK)
        result = dem2di_check_number(env, "crop_top", top, DEM2DI_WHOLE(0, height - 1));
    if (result == DEM2D_OK)
        result =
            dem2di_check_number(env, "crop_width", desc->crop_width, DEM2DI_WHOLE(0, width - left));
    if (result == DEM2D_OK)
        result = dem2di_check_number(env, "crop_height", desc->crop_height,
                                     DEM2DI_WHOLE(0, height - top));
    return result;
}

/* The region of a valid picture. */
static dem2di_picture dem2di_picture_crop(const dem2d_image_desc *desc) {
    dem2di_picture p;
    memset(&p, 0, sizeof p);
    p.desc = *desc;
    p.desc.stride = desc->stride > 0 ? desc->stride : desc->width;
    p.desc.width = desc->crop_width > 0 ? desc->crop_width : desc->width - desc->crop_left;
    p.desc.height = desc->crop_height > 0 ? desc->crop_height : desc->height - desc->crop_top;
    size_t skip = (size_t)desc->crop_top * (size_t)p.desc.stride + (size_t)desc->crop_left;
    if (desc->pixels != NULL) p.desc.pixels = desc->pixels + skip;
    if (desc->pixels16 != NULL) p.desc.pixels16 = desc->pixels16 + skip;
    p.corner.x = desc->crop_left;
    p.corner.y = desc->height - desc->crop_top - p.desc.height;
    return p;
}

static int dem2di_picture_value(const dem2di_picture *p, int row, int column) {
    size_t at = (size_t)row * (size_t)p->desc.stride + (size_t)column;
    return p->desc.pixels16 != NULL ? p->desc.pixels16[at] : p->desc.pixels[at];
}

static size_t dem2di_picture_index(const dem2di_picture *p, int row, int column) {
    return (size_t)row * (size_t)p->desc.width + (size_t)column;
}

/* Is a pixel selected? Outside the region none is. */
static bool dem2di_is_grain(const dem2di_picture *p, int row, int column) {
    if (row < 0 || column < 0 || row >= p->desc.height || column >= p->desc.width) return false;
    int value = dem2di_picture_value(p, row, column);
    return value >= p->low && value <= p->high;
}

static bool dem2di_is_unmarked(const dem2di_picture *p, int row, int column) {
    return dem2di_is_grain(p, row, column) &&
           (p->marks[dem2di_picture_index(p, row, column)] & DEM2DI_MARKED) == 0;
}

/* Put the first pixel of each run of selected, unmarked pixels in a row on the stack. */
static bool dem2di_fill_push(const dem2d_env *env, dem2di_picture *p, int *depth, int row, int from,
                             int to) {
    for (int column = from; column <= to; column++) {
        if (!dem2di_is_unmarked(p, row, column)) continue;
        if (column > from && dem2di_is_unmarked(p, row, column - 1)) continue;
        void *stack = p->stack;
        bool room = dem2di_reserve(env, &stack, &p->capacity, *depth + 1, sizeof *p->stack);
        p->stack = (int *)stack;
        if (!room) return false;
        p->stack[(*depth)++] = (int)dem2di_picture_index(p, row, column);
    }
    return true;
}

/* Mark the component of a selected pixel, run by run; *count gets its number of pixels. */
static bool dem2di_fill(const dem2d_env *env, dem2di_picture *p, int row, int column, int *count) {
    int depth = 0;
    *count = 0;
    if (!dem2di_fill_push(env, p, &depth, row, column, column)) return false;
    while (depth > 0) {
        int at = p->stack[--depth];
        int r = at / p->desc.width, from = at % p->desc.width, to = from;
        if (!dem2di_is_unmarked(p, r, from)) continue;
        while (dem2di_is_unmarked(p, r, from - 1)) from--;
        while (dem2di_is_unmarked(p, r, to + 1)) to++;
        for (int c = from; c <= to; c++) p->marks[dem2di_picture_index(p, r, c)] |= DEM2DI_MARKED;
        *count += to - from + 1;
        if (!dem2di_fill_push(env, p, &depth, r - 1, from, to)) return false;
        if (!dem2di_fill_push(env, p, &depth, r + 1, from, to)) return false;
    }
    return true;
}

/* --- thresholds ------------------------------------------------------------------------------- */

/* Otsu's threshold: it divides the values in two classes with the greatest variance between them.
   Grey values without pixels give a range of equally good thresholds: the result is its middle, so
   that the boundary in a binary picture is halfway between pixels. 0 if there is one grey value
   only. */
static int dem2di_otsu(const uint32_t *histogram, int levels) {
    double all = 0, total = 0, below = 0, sum = 0, best = -1;
    int first = 0, last = -1;
    for (int grey = 0; grey < levels; grey++) {
        all += histogram[grey];
        total += (double)grey * histogram[grey];
    }
    for (int t = 1; t < levels; t++) {
        below += histogram[t - 1];
        sum += (double)(t - 1) * histogram[t - 1];
        if (!(below > 0) || !(below < all)) continue;
        /* w0 w1 (m0 - m1)^2 with w0 = below / all, m0 = sum / below, up to a constant factor */
        double gap = sum * all - below * total, variance = gap / below * (gap / (all - below));
        if (variance > best) {
            best = variance;
            first = last = t;
        } else if (histogram[t - 1] == 0 && last == t - 1) {
            last = t;
        }
    }
    return (first + last + 1) / 2;
}

/* Histogram of the unmarked pixels. */
static void dem2di_histogram(const dem2di_picture *p, uint32_t *histogram) {
    memset(histogram, 0, (size_t)dem2di_picture_levels(&p->desc) * sizeof *histogram);
    for (int row = 0; row < p->desc.height; row++)
        for (int column = 0; column < p->desc.width; column++)
            if (p->marks == NULL || p->marks[dem2di_picture_index(p, row, column)] == 0)
                histogram[dem2di_picture_value(p, row, column)]++;
}

/* Three classes by Otsu: values below edge[0], below edge[1], and the rest, so that the sum of w
   m^2 is greatest. The range of values is divided into 256 steps: enough to find a frame. */
static void dem2di_three_classes(const uint32_t *histogram, int levels, int edge[2]) {
    double below[257] = {0}, sum[257] = {0}, best = -1;
    int low = 0, high = levels - 1, steps = 256;
    while (low < high && histogram[low] == 0) low++;
    while (low < high && histogram[high] == 0) high--;
    int span = high - low + 1, step = (span + steps - 1) / steps;
    steps = (span + step - 1) / step;
    for (int k = 0; k < steps; k++) {
        below[k + 1] = below[k];
        sum[k + 1] = sum[k];
        for (int i = 0; i < step && low + k * step + i <= high; i++) {
            below[k + 1] += histogram[low + k * step + i];
            sum[k + 1] += (double)(k * step + i) * histogram[low + k * step + i];
        }
    }
    edge[0] = edge[1] = high + 1;
    for (int i = 1; i < steps; i++)
        for (int j = i + 1; j < steps; j++) {
            double w[3], m[3], value = 0;
            w[0] = below[i], w[1] = below[j] - below[i], w[2] = below[steps] - below[j];
            m[0] = sum[i], m[1] = sum[j] - sum[i], m[2] = sum[steps] - sum[j];
            for (int k = 0; k < 3; k++) value += w[k] > 0 ? m[k] / w[k] * m[k] : 0;
            if (!(value > best)) continue;
            best = value;
            edge[0] = low + i * step;
            edge[1] = low + j * step;
        }
}

/* Border pixel i of 2 (width + height); corners occur twice. */
static void dem2di_border_pixel(const dem2di_picture *p, int i, int *row, int *column) {
    int w = p->desc.width, h = p->desc.height;
    *row = i < 2 * w ? (i < w ? 0 : h - 1) : (i - 2 * w) % h;
    *column = i < 2 * w ? i % w : (i < 2 * w + h ? 0 : w - 1);
}

/* Mark the frame: pixels of the most frequent class of the border that are connected with it. */
static bool dem2di_mark_frame(const dem2d_env *env, dem2di_picture *p, const uint32_t *histogram) {
    int edge[2], votes[3] = {0, 0, 0}, levels = dem2di_picture_levels(&p->desc), most = 0;
    int around = 2 * (p->desc.width + p->desc.height), row, column, unused;
    dem2di_three_classes(histogram, levels, edge);
    for (int i = 0; i < around; i++) {
        dem2di_border_pixel(p, i, &row, &column);
        int value = dem2di_picture_value(p, row, column);
        votes[(value >= edge[0]) + (value >= edge[1])]++;
    }
    for (int k = 1; k < 3; k++)
        if (votes[k] > votes[most]) most = k;
    p->low = most == 0 ? 0 : edge[most - 1];
    p->high = most == 2 ? levels - 1 : edge[most] - 1;
    for (int i = 0; i < around; i++) {
        dem2di_border_pixel(p, i, &row, &column);
        if (dem2di_is_unmarked(p, row, column) && !dem2di_fill(env, p, row, column, &unused))
            return false;
    }
    return true;
}

/* Allocate the marks, none set. */
static bool dem2di_marks_make(const dem2d_env *env, dem2di_picture *p) {
    size_t size = dem2di_picture_index(p, p->desc.height, 0);
    p->marks = (uint8_t *)dem2di_allocate(env, size, 1);
    if (p->marks != NULL) memset(p->marks, 0, size);
    return p->marks != NULL;
}

static void dem2di_marks_release(const dem2d_env *env, dem2di_picture *p) {
    dem2di_release(env, p->marks, dem2di_picture_index(p, p->desc.height, 0), 1);
    dem2di_release(env, p->stack, (size_t)p->capacity, sizeof *p->stack);
    p->marks = NULL;
    p->stack = NULL;
    p->capacity = 0;
}

/* Otsu's threshold; with ignore_frame of the pixels outside the frame, if they have two values. */
static bool dem2di_find_threshold(const dem2d_env *env, dem2di_picture *p, int *threshold) {
    int levels = dem2di_picture_levels(&p->desc);
    size_t room = (size_t)levels;
    uint32_t *histogram = (uint32_t *)dem2di_allocate(env, room, sizeof *histogram);
    bool good = histogram != NULL;
    if (good) {
        dem2di_histogram(p, histogram);
        *threshold = dem2di_otsu(histogram, levels);
    }
    if (good && p->desc.ignore_frame) {
        good = dem2di_marks_make(env, p) && dem2di_mark_frame(env, p, histogram);
        if (good) {
            dem2di_histogram(p, histogram);
            int inner = dem2di_otsu(histogram, levels);
            if (inner > 0) *threshold = inner;
        }
        dem2di_marks_release(env, p);
    }
    dem2di_release(env, histogram, room, sizeof *histogram);
    return good;
}

DEM2D_API dem2d_result dem2d_image_threshold(const dem2d_image_desc *desc, int *threshold) {
    dem2d_result result = dem2di_check_picture(NULL, desc);
    if (result != DEM2D_OK) return result;
    if (threshold == NULL) return DEM2D_NULL_ARGUMENT;
    if (desc->labels) return DEM2D_OUT_OF_RANGE;
    dem2di_picture p = dem2di_picture_crop(desc);
    int found;
    if (!dem2di_find_threshold(NULL, &p, &found)) return DEM2D_OUT_OF_MEMORY;
    *threshold = found;
    return DEM2D_OK;
}

/* --- components ------------------------------------------------------------------------------- */

/* A component of selected pixels, with the properties that decide whether it is a grain. */
typedef struct dem2di_component {
    dem2d_outline grain;
    int left, right, bottom; /* of its bounding box; its top is the grain's row */
    int own;                 /* pixels without holes */
    bool border;             /* touches the region's border */
} dem2di_component;

/* Counts for the messages to the log. */
typedef struct dem2di_findings {
    int border, small, large, frames; /* components dropped, by reason */
    int frame_row, frame_column;      /* of the first frame */
    int repeated, label;              /* grains with the label of another; the first such label */
    uint8_t labels[65536 / 8];        /* a bit for each label that a grain has */
} dem2di_findings;

/* Position of the boundary between a grain's pixel and a background pixel beside it, as a fraction
   of the distance of their centres: where the linearly interpolated grey value is threshold - 1/2.
   No pixel has that value, so the result is inside (0, 1). At the region's border, and with labels,
   which can't be interpolated, it is 1/2: the side of the pixel. */
static double dem2di_crack_fraction(const dem2di_picture *p, int row, int column, int next_row,
                                    int next_column) {
    if (p->desc.labels || next_row < 0 || next_column < 0 || next_row >= p->desc.height ||
        next_column >= p->desc.width)
        return 0.5;
    int grey = dem2di_picture_value(p, row, column);
    int next = dem2di_picture_value(p, next_row, next_column);
    return (grey - (p->desc.threshold - 0.5)) / (grey - next);
}

/* Extend the bounding box to a pixel. */
static void dem2di_component_widen(dem2di_component *part, int row, int column) {
    if (column < part->left) part->left = column;
    if (column > part->right) part->right = column;
    if (row > part->bottom) part->bottom = row;
}

/* Follow the outer boundary of a component once, from the left side of its topmost, then leftmost
   pixel, with the component on the left: one step for each crack, a side between one of its pixels
   and the background. Sets grain.count (cracks), grain.pixels (inside), the bounding box and
   `border`; marks the pixels if `mark`; writes a point for each crack (points may be NULL). The
   points are those of marching squares: each lies inside a segment between two neighbouring pixel
   centres, and two successive points are in one square of four centres. Where a square has two
   pieces of boundary, each cuts off its own grain corner. So no points coincide and no pieces
   cross. */
static void dem2di_trace(const dem2di_picture *p, dem2di_component *part, bool mark,
                         dem2d_vec *points) {
    static const int down[4] = {1, 0, -1, 0}, right[4] = {0, 1, 0, -1}; /* counter-clockwise */
    int row = part->grain.row, column = part->grain.column, heading = 0, count = 0;
    int width = p->desc.width, height = p->desc.height;
    int64_t pixels = 0;
    part->left = part->right = column;
    part->bottom = row;
    do {
        int side = (heading + 3) % 4; /* background is on the right */
        int out_row = row + down[side], out_column = column + right[side];
        if (points != NULL) {
            double t = dem2di_crack_fraction(p, row, column, out_row, out_column);
            points[count] =
                dem2di_vec((p->corner.x + column + 0.5 + t * right[side]) * p->desc.scale,
                           (p->corner.y + height - row - 0.5 - t * down[side]) * p->desc.scale);
        }
        count++;
        dem2di_component_widen(part, row, column);
        if (heading == 0) pixels -= column; /* rows from left to right sides, holes included */
        if (heading == 2) pixels += column + 1;
        if (mark && heading % 2 == 0)
            p->marks[dem2di_picture_index(p, row, column)] |=
                (uint8_t)(heading == 0 ? DEM2DI_ENTRY : DEM2DI_EXIT);
        int ahead_row = row + down[heading], ahead_column = column + right[heading];
        if (!dem2di_is_grain(p, ahead_row, ahead_column)) {
            heading = (heading + 1) % 4; /* also where two grain pixels touch at a corner */
        } else if (!dem2di_is_grain(p, ahead_row + down[side], ahead_column + right[side])) {
            row = ahead_row;
            column = ahead_column;
        } else {
            row = ahead_row + down[side];
            column = ahead_column + right[side];
            heading = side;
        }
    } while (row != part->grain.row || column != part->grain.column || heading != 0);
    part->grain.count = count;
    part->grain.pixels = (int)pixels;
    part->border = part->grain.row == 0 || part->left == 0 || part->bottom == height - 1 ||
                   part->right == width - 1;
}

/* Is a component a frame: rectangular, hollow, around much of the region, with grains inside? No
   known grain is all of these: a disc fills 0.79 of its box. Less than a quarter of its pixels
   means that a square frame is at most 1/15 of its side thick. A component is found before what it
   encloses, whose pixels are therefore still unmarked. */
static bool dem2di_is_frame(const dem2di_picture *p, const dem2di_component *part) {
    double filled = part->grain.pixels, region = (double)p->desc.width * p->desc.height;
    double box = (double)(part->right - part->left + 1) * (part->bottom - part->grain.row + 1);
    int inside = 0;
    if (p->desc.labels || filled <= region / 4 || filled <= 0.9 * box || part->own >= filled / 4)
        return false;
    for (int row = part->grain.row; row <= part->bottom; row++)
        for (int column = part->left; column <= part->right; column++)
            inside += dem2di_is_unmarked(p, row, column);
    return inside >= p->desc.min_pixels;
}

/* Is a component a grain? If not, the reason is counted. */
static bool dem2di_is_kept(const dem2di_picture *p, const dem2di_component *part,
                           dem2di_findings *found) {
    bool frame = dem2di_is_frame(p, part);
    bool border = part->border && !p->desc.keep_border;
    bool small = part->grain.pixels < p->desc.min_pixels;
    bool large = part->grain.pixels > p->desc.max_pixels;
    if (frame && found->frames == 0) {
        found->frame_row = part->grain.row;
        found->frame_column = part->grain.column;
    }
    found->frames += frame;
    found->border += border && !frame;
    found->small += small && !border;
    found->large += large && !border && !frame;
    return !frame && !border && !small && !large;
}

/* Note the label of a grain, and whether another grain has it. */
static void dem2di_note_label(dem2di_findings *found, int label) {
    uint8_t bit = (uint8_t)(1 << label % 8);
    if ((found->labels[label / 8] & bit) != 0 && found->repeated++ == 0) found->label = label;
    found->labels[label / 8] |= bit;
}

/* Select the values of all grains, or of the one with a label. */
static void dem2di_picture_range(dem2di_picture *p, int label) {
    p->low = p->desc.labels ? label : p->desc.bright ? p->desc.threshold : 0;
    p->high = p->desc.labels ? label : p->desc.bright ? INT_MAX : p->desc.threshold - 1;
}

/* Add the component of an unmarked pixel to the set if it is a grain. */
static bool dem2di_take_component(dem2d_outline_set *set, dem2di_picture *p, int row, int column,
                                  dem2di_findings *found) {
    dem2di_component part;
    memset(&part, 0, sizeof part);
    part.grain.row = row;
    part.grain.column = column;
    dem2di_trace(p, &part, false, NULL);
    if (!dem2di_fill(&set->env, p, row, column, &part.own)) return false;
    if (!dem2di_is_kept(p, &part, found)) return true;
    void *grains = set->grains;
    bool room =
        dem2di_reserve(&set->env, &grains, &set->capacity, set->count + 1, sizeof *set->grains);
    set->grains = (dem2d_outline *)grains;
    if (!room) return false;
    set->grains[set->count++] = part.grain;
    set->point_count += (size_t)part.grain.count;
    if (p->desc.labels)
        dem2di_note_label(found, p->low);
    else
        dem2di_trace(p, &part, true, NULL); /* all that is inside belongs to it */
    return true;
}

/* Find the grains whose first row is this one. Along a row the scan enters and leaves the outer
   boundaries of kept grains in turn; all between, with holes and grains in holes, belongs to the
   grain. With labels no boundaries are marked: a grain inside another is found like any. */
static bool dem2di_scan_row(dem2d_outline_set *set, dem2di_picture *p, int row,
                            dem2di_findings *found) {
    const uint8_t *mark = p->marks + dem2di_picture_index(p, row, 0);
    bool inside = false;
    for (int column = 0; column < p->desc.width; column++) {
        if (!inside && (mark[column] & DEM2DI_ENTRY) == 0) {
            int value = p->desc.labels ? dem2di_picture_value(p, row, column) : 0;
            if (p->desc.labels && value == 0) continue;
            dem2di_picture_range(p, value);
            if (!dem2di_is_unmarked(p, row, column)) continue;
            if (!dem2di_take_component(set, p, row, column, found)) return false;
            if ((mark[column] & DEM2DI_ENTRY) == 0) continue;
        }
        inside = (mark[column] & DEM2DI_EXIT) == 0;
    }
    return true;
}

/* Find the grains and the number of their points, then trace the kept grains again for the points.
   Rows and columns of the result count in the whole picture. */
static bool dem2di_scan_picture(dem2d_outline_set *set, dem2di_picture *p, dem2di_findings *found) {
    size_t next = 0;
    bool room = dem2di_marks_make(&set->env, p);
    for (int row = 0; room && row < p->desc.height; row++)
        room = dem2di_scan_row(set, p, row, found);
    dem2di_marks_release(&set->env, p);
    if (!room || set->count == 0) return room;
    set->points = (dem2d_vec *)dem2di_allocate(&set->env, set->point_count, sizeof *set->points);
    if (set->points == NULL) return false;
    for (int i = 0; i < set->count; i++) {
        dem2di_component part;
        memset(&part, 0, sizeof part);
        part.grain = set->grains[i];
        dem2di_picture_range(p, dem2di_picture_value(p, part.grain.row, part.grain.column));
        dem2di_trace(p, &part, false, set->points + next);
        set->grains[i].points = set->points + next;
        set->grains[i].row += p->desc.crop_top;
        set->grains[i].column += p->desc.crop_left;
        next += (size_t)set->grains[i].count;
    }
    return true;
}

/* Does an outline fill its box and much of the region, as the background in a frame does? */
static bool dem2di_is_like_background(const dem2di_picture *p, const dem2d_outline *grain) {
    dem2d_vec size;
    (void)dem2di_box_of(grain->points, grain->count, &size);
    double box = size.x / p->desc.scale * (size.y / p->desc.scale);
    double region = (double)p->desc.width * p->desc.height;
    return !p->desc.labels && grain->pixels > region / 4 && grain->pixels > 0.9 * box;
}

/* Report to the log what is suspicious, and why no grain was found. */
static void dem2di_report_findings(const dem2d_outline_set *set, const dem2di_picture *p,
                                   const dem2di_findings *found) {
    const dem2d_env *env = &set->env;
    if (found->frames > 0)
        (void)dem2di_fail(
            env, DEM2D_WARNING, -1,
            "%d frame%s left out, the first from row %d, column %d; the grains inside "
            "are kept",
            found->frames, found->frames > 1 ? "s" : "", found->frame_row + p->desc.crop_top,
            found->frame_column + p->desc.crop_left);
    for (int i = 0; i < set->count; i++)
        if (dem2di_is_like_background(p, &set->grains[i]))
            (void)dem2di_fail(
                env, DEM2D_WARNING, i,
                "outline %d has %d of %d by %d pixels, nearly all of its box: is it the "
                "background in a frame? (threshold %d; crop, ignore_frame, bright)",
                i, set->grains[i].pixels, p->desc.width, p->desc.height, p->desc.threshold);
    if (found->repeated > 0)
        (void)dem2di_fail(env, DEM2D_WARNING, -1,
                          "%d grain%s with the label of another grain, the first %d",
                          found->repeated, found->repeated > 1 ? "s" : "", found->label);
    if (set->count == 0 && found->border + found->small + found->large > 0)
        (void)dem2di_fail(
            env, DEM2D_WARNING, -1,
            "no grain: %d touch the border, %d have less than %d pixels, %d more than "
            "%d (threshold %d)",
            found->border, found->small, p->desc.min_pixels, found->large, p->desc.max_pixels,
            p->desc.threshold);
}

static dem2d_result dem2di_check_search(const dem2d_env *env, const dem2d_image_desc *desc) {
    int most = dem2di_picture_levels(desc) - 1;
    dem2d_result result = dem2di_check_fields(env, DEM2DI_ALL(dem2di_search_fields), desc);
    if (result == DEM2D_OK)
        result = dem2di_check_number(env, "threshold", desc->threshold, DEM2DI_WHOLE(0, most));
    if (result != DEM2D_OK) return result;
    if (desc->ignore_frame && desc->threshold > 0)
        return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1,
                           "ignore_frame is for a threshold that is found, threshold = %d",
                           desc->threshold);
    if (desc->labels && (desc->threshold > 0 || desc->ignore_frame || desc->bright))
        return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1,
                           "labels have no threshold = %d, ignore_frame = %d, bright = %d",
                           desc->threshold, desc->ignore_frame, desc->bright);
    return DEM2D_OK;
}

/* All outlines of a checked picture. */
static bool dem2di_outline_picture(dem2d_outline_set *set, const dem2d_image_desc *desc) {
    dem2di_picture p = dem2di_picture_crop(desc);
    dem2di_findings found;
    memset(&found, 0, sizeof found);
    if (p.desc.min_pixels == 0) p.desc.min_pixels = DEM2DI_MIN_PIXELS;
    if (p.desc.max_pixels == 0) p.desc.max_pixels = INT_MAX;
    bool search = p.desc.threshold == 0 && !p.desc.labels;
    if (search && !dem2di_find_threshold(&set->env, &p, &p.desc.threshold)) return false;
    /* a picture of one grey value has no grain, dark or bright */
    if (search && p.desc.threshold == 0) return true;
    if (!dem2di_scan_picture(set, &p, &found)) return false;
    dem2di_report_findings(set, &p, &found);
    return true;
}

DEM2D_API dem2d_result dem2d_image_outlines(const dem2d_env *env, const dem2d_image_desc *desc,
                                            dem2d_outline_set **set) {
    if (set == NULL) return dem2di_fail_null(env, "set");
    dem2d_result result = dem2di_check_picture(env, desc);
    if (result == DEM2D_OK) result = dem2di_check_search(env, desc);
    if (result != DEM2D_OK) return result;
    dem2d_outline_set *made = (dem2d_outline_set *)dem2di_allocate(env, 1, sizeof *made);
    bool room = made != NULL;
    if (room) {
        memset(made, 0, sizeof *made);
        if (env != NULL) made->env = *env;
        room = dem2di_outline_picture(made, desc);
    }
    if (!room) {
        dem2d_outline_set_destroy(made);
        return dem2di_fail(env, DEM2D_OUT_OF_MEMORY, -1,
                           "no memory for outlines of %d by %d pixels", desc->width, desc->height);
    }
    *set = made;
    return DEM2D_OK;
}

DEM2D_API int dem2d_outline_set_count(const dem2d_outline_set *set) {
    return set != NULL ? set->count : 0;
}

DEM2D_API dem2d_result dem2d_outline_set_get(const dem2d_outline_set *set, int i,
                                             dem2d_outline *outline) {
    if (set == NULL) return DEM2D_NULL_ARGUMENT;
    if (outline == NULL) return dem2di_fail_null(&set->env, "outline");
    if (i < 0 || i >= set->count)
        return dem2di_fail(&set->env, DEM2D_OUT_OF_RANGE, i, "outline %d of %d", i, set->count);
    *outline = set->grains[i];
    return DEM2D_OK;
}

DEM2D_API void dem2d_outline_set_destroy(dem2d_outline_set *set) {
    if (set == NULL) return;
    dem2d_env env = set->env;
    dem2di_release(&env, set->points, set->point_count, sizeof *set->points);
    dem2di_release(&env, set->grains, (size_t)set->capacity, sizeof *set->grains);
    dem2di_release(&env, set, 1, sizeof *set);
}

/* --- sides of an outline ---------------------------------------------------------------------- */

/* A side from a to a + e. */
typedef struct dem2di_side {
    dem2d_vec a, e;
    double inverse; /* 1 / e.e */
} dem2di_side;

/* --- outlines that cross themselves ----------------------------------------------------------- */

/* An outline is valid if no two edges cross and it winds around every point once or not at all. It
   may touch itself, at points and along edges that it traverses twice, as outlines from pixels do.
   Winding numbers decide where edges meet at corners or lie on each other. A line sweeps over the
   plane by x, then y (Shamos and Hoey 1976). The edges that it cuts are kept in their order along
   it, in a sorted array, which is short: an outline is cut by a line a few times. Edges that become
   neighbours are tested for a crossing inside both. At a point of the outline the edges through it
   are sorted by their order after the point, which gives the winding numbers between them. Points
   within rounding errors of an edge are on it: edges that touch do not cross. */
#define DEM2DI_SWEEP_ROUNDOFF (64 * DBL_EPSILON) /* of the coordinates: some products and sums */

typedef struct dem2di_sweep_edge {
    dem2d_vec left, right; /* in the order of the sweep; of a vertical edge left is below */
    double slack;          /* rounding error times length */
    int sign;              /* 1 if the outline goes from left to right, else -1 */
    int winding;           /* winding number just above the edge */
    int name;              /* index of the outline's point where the edge begins */
    bool cut;              /* by the sweep line */
} dem2di_sweep_edge;

/* A point of the outline; the edge with this index begins there. */
typedef struct dem2di_sweep_point {
    dem2d_vec at;
    int index;
} dem2di_sweep_point;

typedef struct dem2di_sweep {
    dem2di_sweep_edge *edges;   /* count */
    dem2di_sweep_point *points; /* count */
    int *line;                  /* cut edges, from the lowest to the highest */
    int count, cut;             /* points that differ from the one before; edges in line */
    double roundoff;            /* of coordinates, which are relative to origin and size */
    dem2d_vec origin;
    double size;
    int sense;         /* winding inside: 1, -1, 0 until it is known */
    int first, second; /* names of the edges that cross */
    dem2d_vec where;
} dem2di_sweep;

/* Is p above an edge (1), below (-1), or on its line within rounding errors (0)? */
static int dem2di_sweep_side(const dem2di_sweep *s, int edge, dem2d_vec p) {
    const dem2di_sweep_edge *e = &s->edges[edge];
    double turn = dem2di_cross(dem2di_sub(e->right, e->left), dem2di_sub(p, e->left));
    return (turn > e->slack) - (turn < -e->slack);
}

/* Is an edge that begins at the sweep line above another edge? Decided at its start or, if that is
   on the other edge, at the nearer of their ends. Edges that lie on each other have no order. */
static bool dem2di_sweep_goes_above(const dem2di_sweep *s, int edge, int other) {
    const dem2di_sweep_edge *e = &s->edges[edge], *o = &s->edges[other];
    int side = dem2di_sweep_side(s, other, e->left);
    if (side != 0) return side > 0;
    if (dem2di_compare_points(&e->right, &o->right) <= 0)
        return dem2di_sweep_side(s, other, e->right) >= 0;
    return dem2di_sweep_side(s, edge, o->right) <= 0;
}

/* Put an edge on the sweep line; returns its place there. */
static int dem2di_sweep_insert(dem2di_sweep *s, int edge) {
    int low = 0, high = s->cut;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (dem2di_sweep_goes_above(s, edge, s->line[middle]))
            low = middle + 1;
        else
            high = middle;
    }
    memmove(&s->line[low + 1], &s->line[low], (size_t)(s->cut++ - low) * sizeof *s->line);
    s->line[low] = edge;
    s->edges[edge].cut = true;
    return low;
}

static void dem2di_sweep_remove(dem2di_sweep *s, int place) {
    s->edges[s->line[place]].cut = false;
    memmove(&s->line[place], &s->line[place + 1], (size_t)(--s->cut - place) * sizeof *s->line);
}

/* Number of edges on the sweep line below a point. */
static int dem2di_sweep_below(const dem2di_sweep *s, dem2d_vec p) {
    int low = 0, high = s->cut;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (dem2di_sweep_side(s, s->line[middle], p) > 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static bool dem2di_sweep_found(dem2di_sweep *s, int first, int second, dem2d_vec where) {
    int one = s->edges[first].name, other = s->edges[second].name;
    s->first = one < other ? one : other;
    s->second = one < other ? other : one;
    s->where = where;
    return false;
}

/* Test the edge at a place on the sweep line and the next one, if there are both, for a crossing
   inside both; false if they cross. */
static bool dem2di_sweep_pair(dem2di_sweep *s, int place) {
    if (place < 0 || place + 1 >= s->cut) return true;
    int low = s->line[place], high = s->line[place + 1];
    const dem2di_sweep_edge *a = &s->edges[low], *b = &s->edges[high];
    if (dem2di_sweep_side(s, low, b->left) * dem2di_sweep_side(s, low, b->right) >= 0 ||
        dem2di_sweep_side(s, high, a->left) * dem2di_sweep_side(s, high, a->right) >= 0)
        return true;
    dem2d_vec along = dem2di_sub(a->right, a->left), other = dem2di_sub(b->right, b->left);
    double t = dem2di_cross(dem2di_sub(b->left, a->left), other) / dem2di_cross(along, other);
    return dem2di_sweep_found(s, low, high, dem2di_along(a->left, t, along));
}

/* Do two edges through a point lie on each other after it? */
static bool dem2di_sweep_overlap(const dem2di_sweep *s, int a, int b) {
    const dem2di_sweep_edge *e = &s->edges[a], *f = &s->edges[b];
    return dem2di_compare_points(&e->right, &f->right) <= 0
               ? dem2di_sweep_side(s, b, e->right) == 0
               : dem2di_sweep_side(s, a, f->right) == 0;
}

/* Winding numbers between the edges through p, which are at the places from `below` to `top`. */
static bool dem2di_sweep_windings(dem2di_sweep *s, int below, int top, dem2d_vec p) {
    int winding = below > 0 ? s->edges[s->line[below - 1]].winding : 0;
    for (int i = below; i < top; i++) {
        int edge = s->line[i];
        winding += s->edges[edge].sign;
        s->edges[edge].winding = winding;
        if (i + 1 < top && dem2di_sweep_overlap(s, edge, s->line[i + 1])) continue;
        if (s->sense == 0 && abs(winding) == 1) s->sense = winding;
        if (winding == 0 || winding == s->sense) continue;
        int beside = i > below ? i - 1 : i + 1 < s->cut ? i + 1 : i > 0 ? i - 1 : i;
        return dem2di_sweep_found(s, s->line[beside], edge, p);
    }
    return true;
}

/* Do two points coincide within rounding errors? */
static bool dem2di_sweep_same(const dem2di_sweep *s, dem2d_vec p, dem2d_vec q) {
    dem2d_vec apart = dem2di_sub(p, q);
    return dem2di_dot(apart, apart) <= 4 * s->roundoff * s->roundoff;
}

/* Edge i of those at the sorted points, two for each point: the one that begins there, the one that
   ends there. */
static int dem2di_sweep_edge_at(const dem2di_sweep *s, int i) {
    int index = s->points[i / 2].index;
    return i % 2 == 0 ? index : index > 0 ? index - 1 : s->count - 1;
}

/* The sweep line reaches points [from, to) of the outline, which coincide. The edges through them
   are at the places from `below` to `top`. */
static bool dem2di_sweep_event(dem2di_sweep *s, int from, int to) {
    dem2d_vec p = s->points[from].at;
    int below = dem2di_sweep_below(s, p), top = below;
    while (top < s->cut && dem2di_sweep_side(s, s->line[top], p) == 0)
        if (dem2di_sweep_same(s, s->edges[s->line[top]].right, p))
            dem2di_sweep_remove(s, top);
        else
            top++;
    for (int i = 2 * from; i < 2 * to; i++) { /* only rounding errors leave any */
        int edge = dem2di_sweep_edge_at(s, i), k = 0;
        if (dem2di_compare_points(&s->edges[edge].right, &p) != 0 || !s->edges[edge].cut) continue;
        while (s->line[k] != edge) k++;
        if (k == below - 1 || k == top) continue;
        dem2di_sweep_remove(s, k);
        below -= k < below;
        top -= k < top;
    }
    for (int i = below - 1; i < top; i++)
        if (!dem2di_sweep_pair(s, i)) return false;
    for (int i = 2 * from; i < 2 * to; i++) {
        int edge = dem2di_sweep_edge_at(s, i);
        if (dem2di_compare_points(&s->edges[edge].left, &p) != 0) continue;
        int k = dem2di_sweep_insert(s, edge);
        below += k < below;
        top += k <= top;
        if (!dem2di_sweep_pair(s, k - 1) || !dem2di_sweep_pair(s, k)) return false;
    }
    return dem2di_sweep_windings(s, below, top, p);
}

static int dem2di_compare_sweep_points(const void *a, const void *b) {
    const dem2di_sweep_point *p = (const dem2di_sweep_point *)a;
    const dem2di_sweep_point *q = (const dem2di_sweep_point *)b;
    int order = dem2di_compare_points(&p->at, &q->at);
    return order != 0 ? order : (p->index > q->index) - (p->index < q->index);
}

/* Take the points that differ from the one before, relative to origin and size; the last differs
   from the first. */
static void dem2di_sweep_points(dem2di_sweep *s, const dem2d_vec *points, int count) {
    dem2d_vec extent;
    s->origin = dem2di_box_of(points, count, &extent).lower;
    s->size = dem2di_max(extent.x, extent.y);
    if (!(s->size > 0)) return; /* all in one place */
    s->roundoff = DEM2DI_SWEEP_ROUNDOFF * (dem2di_coordinate_size(points, count) / s->size);
    for (int i = 0; i < count; i++) {
        dem2d_vec p = dem2di_sub(points[i], s->origin);
        p = dem2di_vec(p.x / s->size, p.y / s->size);
        if (s->count > 0 && dem2di_sweep_same(s, p, s->points[s->count - 1].at)) continue;
        s->edges[s->count].name = i;
        s->points[s->count].at = p;
        s->points[s->count].index = s->count;
        s->count++;
    }
    while (s->count > 1 && dem2di_sweep_same(s, s->points[0].at, s->points[s->count - 1].at))
        s->count--;
}

static void dem2di_sweep_edges(dem2di_sweep *s) {
    for (int i = 0; i < s->count; i++) {
        dem2di_sweep_edge *e = &s->edges[i];
        dem2d_vec p = s->points[i].at, q = s->points[i + 1 < s->count ? i + 1 : 0].at;
        bool rises = dem2di_compare_points(&p, &q) < 0;
        e->left = rises ? p : q;
        e->right = rises ? q : p;
        e->sign = rises ? 1 : -1;
        e->slack = s->roundoff * dem2di_length(dem2di_sub(q, p));
        e->cut = false;
    }
}

/* Is the outline valid? If not, first, second and where describe a crossing. */
static bool dem2di_sweep_run(dem2di_sweep *s, const dem2d_vec *points, int count) {
    dem2di_sweep_points(s, points, count);
    dem2di_sweep_edges(s);
    qsort(s->points, (size_t)s->count, sizeof *s->points, dem2di_compare_sweep_points);
    for (int i = 0, next; i < s->count; i = next) {
        next = i + 1;
        while (next < s->count && dem2di_compare_points(&s->points[next].at, &s->points[i].at) == 0)
            next++;
        if (!dem2di_sweep_event(s, i, next)) return false;
    }
    return true;
}

/* Check that an outline of finite points is valid. */
static dem2d_result dem2di_check_crossing(const dem2d_env *env, const char *name,
                                          const dem2d_vec *points, int count) {
    dem2di_sweep s;
    size_t room = (size_t)count, size = sizeof *s.edges + sizeof *s.points + sizeof *s.line;
    dem2d_result result = DEM2D_OK;
    memset(&s, 0, sizeof s);
    s.edges = (dem2di_sweep_edge *)dem2di_allocate(env, room, size);
    if (s.edges == NULL)
        return dem2di_fail(env, DEM2D_OUT_OF_MEMORY, -1, "%s: no memory for %d points", name,
                           count);
    s.points = (dem2di_sweep_point *)(void *)(s.edges + room);
    s.line = (int *)(void *)(s.points + room);
    if (!dem2di_sweep_run(&s, points, count)) {
        dem2d_vec where = dem2di_along(s.origin, s.size, s.where);
        result =
            dem2di_fail(env, DEM2D_CROSSING, s.first,
                        "%s: edges %d and %d cross or overlap at (%.9g, %.9g); edge i begins at "
                        "point i",
                        name, s.first, s.second, where.x, where.y);
    }
    dem2di_release(env, s.edges, room, size);
    return result;
}

/* Points of a caller that enclose an area. */
static dem2d_result dem2di_check_outline(const dem2d_env *env, const char *name,
                                         const dem2d_vec *points, int count, dem2d_mass *mass) {
    dem2d_result result = dem2di_check_points(env, name, points, count, 3);
    if (result != DEM2D_OK) return result;
    result = dem2d_polygon_mass(points, count, mass);
    if (result != DEM2D_OK)
        return dem2di_fail(env, result, -1, "%s: the outline has no area", name);
    return DEM2D_OK;
}

/* The same for a valid outline: a figure of eight may have no area, so a crossing is reported
   first. */
static dem2d_result dem2di_check_good_outline(const dem2d_env *env, const char *name,
                                              const dem2d_vec *points, int count,
                                              dem2d_mass *mass) {
    dem2d_result result = dem2di_check_points(env, name, points, count, 3);
    if (result == DEM2D_OK) result = dem2di_check_crossing(env, name, points, count);
    if (result != DEM2D_OK) return result;
    return dem2di_check_outline(env, name, points, count, mass);
}

/* The sides of nonzero length, counter-clockwise, relative to an origin. Returns their number. */
static int dem2di_sides_make(const dem2d_vec *points, int count, dem2d_vec origin,
                             dem2di_side *sides) {
    bool reversed = dem2di_twice_area(points, count) < 0;
    int made = 0;
    for (int i = 0; i < count; i++) {
        int from = reversed ? count - 1 - i : i;
        int to = reversed ? (from > 0 ? from - 1 : count - 1) : (from + 1 < count ? from + 1 : 0);
        dem2di_side *side = &sides[made];
        side->a = dem2di_sub(points[from], origin);
        side->e = dem2di_sub(points[to], points[from]);
        double square = dem2di_dot(side->e, side->e);
        if (!(square > 0)) continue;
        side->inverse = 1 / square;
        made++;
    }
    return made;
}

/* From the nearest point of a side to p. */
static dem2d_vec dem2di_side_offset(const dem2di_side *side, dem2d_vec p) {
    dem2d_vec v = dem2di_sub(p, side->a);
    double t = dem2di_dot(v, side->e) * side->inverse;
    t = t < 0 ? 0 : (t > 1 ? 1 : t);
    return dem2di_along(v, -t, side->e);
}

static double dem2di_side_square(const dem2di_side *side, dem2d_vec p) {
    dem2d_vec v = dem2di_side_offset(side, p);
    return dem2di_dot(v, v);
}

/* --- Feret diameters and the least circle around ---------------------------------------------- */

/* Rotating calipers: the corner farthest from an edge of the hull advances with the edge. The least
   width is at an edge; the greatest distance is between an end of an edge and a corner farthest
   from that edge. ends gets the two corners of the greatest distance. */
static void dem2di_calipers(const dem2d_vec *hull, int count, dem2d_outline_info *info,
                            int ends[2]) {
    double most = 0;
    for (int i = 0, j = 1; i < count; i++) {
        int next = i + 1 < count ? i + 1 : 0;
        dem2d_vec edge = dem2di_sub(hull[next], hull[i]);
        int after = j + 1 < count ? j + 1 : 0;
        while (dem2di_cross(edge, dem2di_sub(hull[after], hull[j])) > 0) {
            j = after;
            after = j + 1 < count ? j + 1 : 0;
        }
        double width = dem2di_cross(edge, dem2di_sub(hull[j], hull[i])) / dem2di_length(edge);
        if (i == 0 || width < info->feret_min) info->feret_min = width;
        for (int k = 0; k < 4; k++) { /* j and after are equally far if their edge is parallel */
            int one = k % 2 == 0 ? i : next, other = k < 2 ? j : after;
            dem2d_vec span = dem2di_sub(hull[one], hull[other]);
            if (!(dem2di_dot(span, span) > most)) continue;
            most = dem2di_dot(span, span);
            ends[0] = one;
            ends[1] = other;
        }
    }
    info->feret_max = sqrt(most);
}

/* Centre of the circle through 3 points, false if they are on one line, or of the smallest circle
   through 2. */
static bool dem2di_circle_through(const dem2d_vec *p, int count, dem2d_vec *centre) {
    dem2d_vec b = dem2di_sub(p[1], p[0]);
    *centre = dem2di_along(p[0], 0.5, b);
    if (count == 2) return true;
    dem2d_vec c = dem2di_sub(p[2], p[0]);
    double twice = 2 * dem2di_cross(b, c), bb = dem2di_dot(b, b), cc = dem2di_dot(c, c);
    dem2d_vec top = dem2di_vec(c.y * bb - b.y * cc, b.x * cc - c.x * bb);
    *centre = dem2di_add(p[0], dem2di_vec(top.x / twice, top.y / twice));
    return dem2di_vec_finite(*centre);
}

/* Square of the greatest distance of a point from the centre; *at gets the point's index. */
static double dem2di_farthest_point(const dem2d_vec *points, int count, dem2d_vec centre, int *at) {
    double most = -1;
    for (int i = 0; i < count; i++) {
        dem2d_vec v = dem2di_sub(points[i], centre);
        double square = dem2di_dot(v, v);
        if (!(square > most)) continue;
        most = square;
        *at = i;
    }
    return most;
}

/* The smallest circle around count <= 4 points that passes through the last one: of the circles
   through it and one or two others, the centre whose farthest point is nearest. The points on the
   circle move to the front; returns their number. */
static int dem2di_circle_update(dem2d_vec *p, int count, dem2d_vec *centre) {
    dem2d_vec chosen[3] = {{0, 0}, {0, 0}, {0, 0}};
    int best = 0, unused = 0, n = count - 1;
    double least = 0;
    for (int i = 0; i < n; i++)
        for (int j = i; j < n; j++) { /* j = i: a circle of two points */
            dem2d_vec through[3], c;
            through[0] = p[n];
            through[1] = p[i];
            through[2] = p[j];
            int size = j > i ? 3 : 2;
            if (!dem2di_circle_through(through, size, &c)) continue;
            double square = dem2di_farthest_point(p, count, c, &unused);
            if (best > 0 && !(square < least)) continue;
            best = size;
            least = square;
            *centre = c;
            memcpy(chosen, through, sizeof chosen);
        }
    memcpy(p, chosen, (size_t)best * sizeof *p);
    return best;
}

/* Smallest circle around the hull (Elzinga and Hearn): the circle of two or three corners grows by
   the corner farthest outside, until there is none or the growth is within rounding errors. */
static void dem2di_circumscribe(const dem2d_vec *hull, int count, const int ends[2],
                                dem2d_outline_info *info) {
    dem2d_vec stand[4], centre = {0, 0}, found;
    int size = 2, at = 0;
    stand[0] = hull[ends[0]];
    stand[1] = hull[ends[1]];
    (void)dem2di_circle_through(stand, 2, &centre);
    double inner = dem2di_farthest_point(stand, 2, centre, &at);
    double outer = dem2di_farthest_point(hull, count, centre, &at);
    while (outer > inner) {
        stand[size] = hull[at];
        int next = dem2di_circle_update(stand, size + 1, &found);
        double grown = dem2di_farthest_point(stand, next, found, &at);
        if (!(grown > inner * (1 + 8 * DBL_EPSILON))) break; /* within rounding errors */
        double around = dem2di_farthest_point(hull, count, found, &at);
        size = next;
        inner = grown;
        centre = found;
        outer = around;
    }
    info->circumscribed = sqrt(outer);
    info->circumscribed_at = centre;
}

/* --- the greatest circle inside --------------------------------------------------------------- */

/* A side of the outline, relative to the centre of a cell. */
typedef struct dem2di_near_side {
    dem2d_vec offset; /* from its nearest point to the centre */
    double square;    /* of the offset's length */
    int side;
} dem2di_near_side;

typedef struct dem2di_inscribe {
    const dem2di_side *sides;
    int count;
    dem2di_near_side *near; /* all sides; those that can be nearest in a cell come first */
    double best, tolerance; /* m */
    dem2d_vec at;
} dem2di_inscribe;

/* Is p inside, if side k is nearest? The side decides or, if the nearest point is a corner, both of
   its sides: at a convex corner p has to be left of both, at a reflex one left of one. */
static bool dem2di_inside_of(const dem2di_inscribe *in, int k, dem2d_vec p) {
    const dem2di_side *side = &in->sides[k];
    dem2d_vec v = dem2di_sub(p, side->a);
    double t = dem2di_dot(v, side->e) * side->inverse;
    bool left = dem2di_cross(side->e, v) > 0;
    if (t > 0 && t < 1) return left;
    int n = in->count, other = t > 0 ? (k + 1) % n : (k + n - 1) % n;
    const dem2di_side *beside = &in->sides[other];
    bool left_too = dem2di_cross(beside->e, dem2di_sub(p, beside->a)) > 0;
    double turn = dem2di_cross(side->e, beside->e); /* in the order of the sides: */
    bool convex = t > 0 ? turn >= 0 : turn <= 0;
    return convex ? left && left_too : left || left_too;
}

/* Upper bound of the distance from the boundary in the disc of radius s about a cell's centre. With
   v_i from boundary points to the centre, weights w_i >= 0 of sum 1 and |x| <= s: min |v_i + x|^2
   <= sum w_i |v_i|^2 + 2 s |sum w_i v_i| + s^2. Where boundary points lie on all sides the middle
   term can vanish, and the bound is quadratic in s: few cells are left. The weights come from steps
   of Gilbert's method towards the least |sum w_i v_i|. *pull gets that sum, a direction in which
   the distance grows. */
static double dem2di_distance_bound(const dem2di_inscribe *in, int count, int nearest, double s,
                                    dem2d_vec *pull) {
    dem2d_vec sum = in->near[nearest].offset;
    double square = in->near[nearest].square, bound = sqrt(square) + s;
    *pull = sum;
    for (int step = 0; step < 6 && bound > in->best + in->tolerance; step++) {
        double length = dem2di_length(sum), least = DBL_MAX;
        int chosen = nearest;
        for (int i = 0; i < count && length > 0; i++) {
            double value =
                in->near[i].square + 2 * s / length * dem2di_dot(sum, in->near[i].offset);
            if (value < least) least = value, chosen = i;
        }
        dem2d_vec apart = dem2di_sub(sum, in->near[chosen].offset);
        double w = dem2di_dot(sum, apart) / dem2di_dot(apart, apart);
        if (!(w > 0)) break; /* no lower sum; also 0 / 0 */
        if (w > 1) w = 1;
        sum = dem2di_along(sum, -w, apart);
        square += w * (in->near[chosen].square - square);
        double lower = sqrt(square + 2 * s * dem2di_length(sum) + s * s);
        if (!(lower < bound)) break;
        bound = lower;
        *pull = sum;
    }
    return bound;
}

/* Move the sides that can be nearest somewhere in the cell to the front. Returns their number. */
static int dem2di_near_keep(dem2di_inscribe *in, int count, double limit) {
    int kept = 0;
    for (int i = 0; i < count; i++) {
        if (in->near[i].square > limit * limit) continue;
        dem2di_near_side one = in->near[i];
        in->near[i] = in->near[kept];
        in->near[kept++] = one;
    }
    return kept;
}

/* Branch and bound in a square cell; the first `count` sides can be nearest in it, and its quarters
   permute only these. The quarter where the distance grows comes first. */
static void dem2di_inscribe_cell(dem2di_inscribe *in, dem2d_vec centre, double half, int count,
                                 int depth) {
    int nearest = 0;
    for (int i = 0; i < count; i++) {
        dem2di_near_side *one = &in->near[i];
        one->offset = dem2di_side_offset(&in->sides[one->side], centre);
        one->square = dem2di_dot(one->offset, one->offset);
        if (one->square < in->near[nearest].square) nearest = i;
    }
    /* 1.4143 is just above the square root of 2 */
    double distance = sqrt(in->near[nearest].square), s = 1.4143 * half, bound = s - distance;
    dem2d_vec uphill = dem2di_negate(in->near[nearest].offset);
    if (dem2di_inside_of(in, in->near[nearest].side, centre)) {
        if (distance > in->best) {
            in->best = distance;
            in->at = centre;
        }
        bound = dem2di_distance_bound(in, count, nearest, s, &uphill);
    }
    if (bound <= in->best + in->tolerance || depth == 0) return;
    count = dem2di_near_keep(in, count, distance + 2 * s);
    double x = uphill.x < 0 ? -half / 2 : half / 2, y = uphill.y < 0 ? -half / 2 : half / 2;
    bool level = fabs(uphill.x) > fabs(uphill.y);
    for (int k = 0; k < 4; k++) { /* second the neighbour that falls less, last the opposite one */
        bool flip = k == 1 || k == 3, other = k >= 2;
        dem2d_vec c = dem2di_vec(centre.x + ((level ? other : flip) ? -x : x),
                                 centre.y + ((level ? flip : other) ? -y : y));
        dem2di_inscribe_cell(in, c, half / 2, count, depth - 1);
    }
}

/* The largest inscribed circle, to 1e-6 of the greatest diameter. 22 halvings make the cells
   smaller than a quarter of that; a smaller circle may be missed. */
static bool dem2di_inscribed(const dem2d_env *env, const dem2di_side *sides, int count,
                             dem2d_outline_info *info) {
    dem2di_inscribe in;
    dem2d_box box = {sides[0].a, sides[0].a};
    in.near = (dem2di_near_side *)dem2di_allocate(env, (size_t)count, sizeof *in.near);
    if (in.near == NULL) return false;
    for (int i = 0; i < count; i++) {
        in.near[i].side = i;
        dem2di_box_add(&box, sides[i].a);
    }
    dem2d_vec size = dem2di_sub(box.upper, box.lower);
    in.sides = sides;
    in.count = count;
    in.best = 0;
    in.at = dem2di_vec(0, 0);
    in.tolerance = 1e-6 * info->feret_max;
    double half = dem2di_max(size.x, size.y) / 2;
    dem2di_inscribe_cell(&in, dem2di_along(box.lower, 0.5, size), half, count, 22);
    dem2di_release(env, in.near, (size_t)count, sizeof *in.near);
    info->inscribed = in.best;
    info->inscribed_at = dem2di_add(info->mass.centroid, in.at);
    return true;
}

/* --- roundness -------------------------------------------------------------------------------- */

/* Number of samples along a circumference of the largest inscribed circle, and of passes of a mean
   over five that smooth them: a standard deviation of sqrt(3 (25 - 1) / 12) = 2.45 samples, or 2 pi
   2.45 / 320 = 5 % of that circle's radius. On grains about 120 pixels across that is three pixels:
   it removes the steps of pixels and keeps the corners. 200 to 512 samples follow the published
   roundness of real grains equally well, 320 with the least offset. */
#define DEM2DI_SAMPLES_PER_TURN 320
#define DEM2DI_SAMPLES 2048 /* at most, for needles: the time grows as the square */
#define DEM2DI_PASSES 3

/* n samples in equal steps along the sides. */
static void dem2di_resample(const dem2di_side *sides, int count, double perimeter,
                            dem2d_vec *samples, int n) {
    int k = 0;
    double start = 0, length = dem2di_length(sides[0].e);
    for (int i = 0; i < n; i++) {
        double place = perimeter * i / n;
        while (k + 1 < count && place > start + length) {
            start += length;
            length = dem2di_length(sides[++k].e);
        }
        samples[i] = dem2di_along(sides[k].a, dem2di_min((place - start) / length, 1), sides[k].e);
    }
}

static void dem2di_smooth(dem2d_vec *samples, dem2d_vec *spare, int n) {
    for (int pass = 0; pass < DEM2DI_PASSES; pass++) {
        memcpy(spare, samples, (size_t)n * sizeof *spare);
        for (int i = 0; i < n; i++) {
            dem2d_vec sum = spare[i];
            for (int j = 1; j <= 2; j++) {
                sum = dem2di_add(sum, spare[i + j < n ? i + j : i + j - n]);
                sum = dem2di_add(sum, spare[i >= j ? i - j : i - j + n]);
            }
            samples[i] = dem2di_scale(sum, 0.2);
        }
    }
}

/* Radius of the largest inscribed disc that touches at sample i. A disc on the inner normal n
   through sample j has the radius |v|^2 / (2 n.v) with v from i to j; the least of these counts. At
   a corner it is the radius of curvature, elsewhere the opposite side limits it. Compares fractions
   without division. */
static double dem2di_touching_radius(const dem2d_vec *samples, int n, int i, dem2d_vec normal) {
    double square = 1, across = 0;
    for (int j = 0; j < n; j++) {
        double x = samples[j].x - samples[i].x, y = samples[j].y - samples[i].y;
        double s = normal.x * x + normal.y * y, d = x * x + y * y;
        if (s * square > across * d) {
            square = d;
            across = s;
        }
    }
    return across > 0 ? square / (2 * across) : DBL_MAX;
}

/* Wadell's roundness without choosing corners by hand: corners are where the touching disc is
   smaller than the largest inscribed one, and their radii are averaged over the angle that they
   turn by. A corner that is a circular arc counts with its radius, as in Wadell's mean. samples has
   room for 2 DEM2DI_SAMPLES points. */
static double dem2di_roundness(const dem2di_side *sides, int count, double perimeter,
                               double inscribed, dem2d_vec *samples) {
    double sum = 0, all = 0, turns = perimeter / (2 * DEM2DI_PI * inscribed);
    double most = (double)DEM2DI_SAMPLES / DEM2DI_SAMPLES_PER_TURN;
    int n = turns < most ? (int)(turns * DEM2DI_SAMPLES_PER_TURN) : DEM2DI_SAMPLES;
    if (!(inscribed > 0)) return 0; /* too thin to have an inscribed circle */
    dem2di_resample(sides, count, perimeter, samples, n);
    dem2di_smooth(samples, samples + DEM2DI_SAMPLES, n);
    for (int i = 0; i < n; i++) {
        dem2d_vec before = samples[i > 0 ? i - 1 : n - 1], after = samples[i + 1 < n ? i + 1 : 0];
        dem2d_vec in = dem2di_sub(samples[i], before), out = dem2di_sub(after, samples[i]), normal;
        if (!(dem2di_cross(in, out) > 0)) continue; /* concave or straight */
        if (!dem2di_unit(dem2di_perp(dem2di_sub(after, before)), &normal)) continue;
        double radius = dem2di_touching_radius(samples, n, i, normal);
        if (!(radius < inscribed)) continue;
        double turn = dem2di_angle(in, out);
        sum += turn * radius;
        all += turn;
    }
    return all > 0 ? sum / all / inscribed : 1;
}

/* All measures but the mass; room is for count + 2 DEM2DI_SAMPLES points. */
static dem2d_result dem2di_measure(const dem2d_env *env, const dem2d_vec *points, int count,
                                   dem2di_side *sides, dem2d_vec *room, dem2d_outline_info *info) {
    int corners = 0, ends[2] = {0, 0};
    dem2d_vec *hull = room + 2 * DEM2DI_SAMPLES;
    dem2d_result result = dem2d_polygon_hull(env, points, count, hull, &corners);
    if (result != DEM2D_OK) return result;
    for (int i = 0; i < corners; i++) hull[i] = dem2di_sub(hull[i], info->mass.centroid);
    dem2di_calipers(hull, corners, info, ends);
    dem2di_circumscribe(hull, corners, ends, info);
    info->circumscribed_at = dem2di_add(info->circumscribed_at, info->mass.centroid);
    info->solidity = info->mass.area / (dem2di_twice_area(hull, corners) / 2);
    info->sphericity = info->feret_min / info->feret_max;
    info->aspect = info->feret_max / info->feret_min;
    int n = dem2di_sides_make(points, count, info->mass.centroid, sides);
    for (int i = 0; i < n; i++) info->perimeter += dem2di_length(sides[i].e);
    info->circularity = 4 * DEM2DI_PI * info->mass.area / (info->perimeter * info->perimeter);
    if (!dem2di_inscribed(env, sides, n, info)) return dem2di_fail_memory(env, n, "sides");
    info->roundness = dem2di_roundness(sides, n, info->perimeter, info->inscribed, room);
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_outline_measure(const dem2d_env *env, const dem2d_vec *points,
                                             int count, dem2d_outline_info *info) {
    dem2d_outline_info found;
    memset(&found, 0, sizeof found);
    if (info == NULL) return dem2di_fail_null(env, "info");
    dem2d_result result = dem2di_check_good_outline(env, "points", points, count, &found.mass);
    if (result != DEM2D_OK) return result;
    size_t n = (size_t)count, size = n + 2 * DEM2DI_SAMPLES;
    dem2di_side *sides = (dem2di_side *)dem2di_allocate(env, n, sizeof *sides);
    dem2d_vec *room = sides != NULL ? (dem2d_vec *)dem2di_allocate(env, size, sizeof *room) : NULL;
    if (room != NULL)
        result = dem2di_measure(env, points, count, sides, room, &found);
    else
        result = dem2di_fail_memory(env, count, "points to measure");
    dem2di_release(env, room, size, sizeof *room);
    dem2di_release(env, sides, n, sizeof *sides);
    if (result == DEM2D_OK) *info = found;
    return result;
}

/* --- area of the symmetric difference --------------------------------------------------------- */

/* A side that is not horizontal, from its lower to its upper end. */
typedef struct dem2di_rise {
    double y, x, top, end; /* from (x, y) to (end, top) */
    double slope;          /* change of x over change of y */
    int of;                /* outline 0 or 1 */
} dem2di_rise;

/* The y of a rise's lower end, to sort by. */
typedef struct dem2di_level {
    double y;
    int rise;
} dem2di_level;

/* The part of a rise in the slab between two levels: x on the lower and on the upper level. */
typedef struct dem2di_strand {
    double low, high;
    int rise, of;
} dem2di_strand;

/* Arrays for two outlines of `room` points together. */
typedef struct dem2di_slabs {
    dem2di_rise *rises;
    dem2di_level *levels; /* 2 room */
    int *ends;            /* of sorted runs */
    dem2di_strand *strands;
    int count; /* of rises */
} dem2di_slabs;

/* Add the rises of an outline. A side that both outlines have gives the same numbers, whatever
   their orientation. */
static void dem2di_slabs_add(dem2di_slabs *slabs, const dem2d_vec *points, int count,
                             dem2d_vec origin, int of) {
    dem2d_vec from = dem2di_sub(points[count - 1], origin);
    for (int i = 0; i < count; i++) {
        dem2d_vec to = dem2di_sub(points[i], origin);
        bool up = from.y < to.y;
        if (up || from.y > to.y) {
            dem2di_rise *rise = &slabs->rises[slabs->count];
            rise->x = up ? from.x : to.x;
            rise->y = up ? from.y : to.y;
            rise->end = up ? to.x : from.x;
            rise->top = up ? to.y : from.y;
            rise->slope = (rise->end - rise->x) / (rise->top - rise->y);
            rise->of = of;
            slabs->levels[slabs->count].y = rise->y;
            slabs->levels[slabs->count].rise = slabs->count;
            slabs->count++;
        }
        from = to;
    }
}

/* Find ascending runs, and reverse descending ones; ends gets where each run ends. Returns their
   number. */
static int dem2di_level_runs(dem2di_level *levels, int count, int *ends) {
    int runs = 0;
    for (int i = 0; i < count;) {
        int j = i + 1;
        bool falls = j < count && levels[j].y < levels[i].y;
        while (j < count && (levels[j].y < levels[j - 1].y) == falls) j++;
        for (int a = i, b = j - 1; falls && a < b; a++, b--) {
            dem2di_level level = levels[a];
            levels[a] = levels[b];
            levels[b] = level;
        }
        ends[runs++] = i = j;
    }
    return runs;
}

/* Merge sort that begins with the runs it finds: outlines rise and fall only a few times. */
static const dem2di_level *dem2di_levels_sort(dem2di_level *levels, int count, int *ends) {
    dem2di_level *from = levels, *to = levels + count;
    int runs = dem2di_level_runs(levels, count, ends);
    while (runs > 1) {
        int merged = 0, start = 0;
        for (int r = 0; r < runs; r += 2) {
            int middle = ends[r], end = r + 1 < runs ? ends[r + 1] : middle;
            for (int i = start, j = middle, k = start; k < end; k++)
                to[k] = j == end || (i < middle && from[i].y <= from[j].y) ? from[i++] : from[j++];
            ends[merged++] = start = end;
        }
        runs = merged;
        dem2di_level *swap = from;
        from = to;
        to = swap;
    }
    return from;
}

/* Length inside exactly one outline: x on the lower level, y on the upper level. */
static dem2d_vec dem2di_strands_width(const dem2di_strand *strands, int count) {
    dem2d_vec width = {0, 0};
    bool in[2] = {false, false};
    for (int i = 0; i + 1 < count; i++) {
        in[strands[i].of] = !in[strands[i].of];
        if (in[0] == in[1]) continue;
        width.x += strands[i + 1].low - strands[i].low;
        width.y += strands[i + 1].high - strands[i].high;
    }
    return width;
}

/* Area inside exactly one outline in a slab of height 1. The strands are sorted on its lower level;
   between crossings the width is linear. Each crossing swaps one pair into the order of the upper
   level. */
static double dem2di_slab_area(dem2di_strand *strands, int count) {
    double area = 0, at = 0;
    for (;;) {
        int swap = -1;
        double next = 1;
        for (int i = 0; i + 1 < count; i++) {
            double low = strands[i + 1].low - strands[i].low;
            double high = strands[i + 1].high - strands[i].high;
            if (!(high < 0)) continue;
            double t = low / (low - high); /* with rounding errors it may be below at */
            t = t > at ? dem2di_min(t, 1) : at;
            if (swap >= 0 && !(t < next)) continue;
            swap = i;
            next = t;
        }
        dem2d_vec width = dem2di_strands_width(strands, count);
        double middle = (at + next) / 2;
        area += (next - at) * (width.x + middle * (width.y - width.x));
        if (swap < 0) return area;
        dem2di_strand one = strands[swap];
        strands[swap] = strands[swap + 1];
        strands[swap + 1] = one;
        at = next;
    }
}

/* Go to the next slab: remove the strands that end at y, continue the others from their upper x. */
static int dem2di_strands_advance(const dem2di_slabs *slabs, int count, double y) {
    int kept = 0;
    for (int i = 0; i < count; i++) {
        dem2di_strand one = slabs->strands[i];
        if (slabs->rises[one.rise].top <= y) continue;
        one.low = one.high;
        slabs->strands[kept++] = one;
    }
    return kept;
}

/* Compute x on the upper level y, and sort by x on the lower one; insertion is fast, since the
   strands are nearly sorted. Strands with equal x in the wrong order for the upper level give the
   first crossings. */
static void dem2di_strands_order(const dem2di_slabs *slabs, int count, double y) {
    dem2di_strand *strands = slabs->strands;
    for (int i = 0; i < count; i++) {
        dem2di_strand one = strands[i];
        const dem2di_rise *rise = &slabs->rises[one.rise];
        one.high = y < rise->top ? rise->x + rise->slope * (y - rise->y) : rise->end;
        int k = i;
        for (; k > 0 && strands[k - 1].low > one.low; k--) strands[k] = strands[k - 1];
        strands[k] = one;
    }
}

/* Area of all slabs. Between the levels of neighbouring corners all sides are straight, so the area
   of each slab is exact. */
static double dem2di_slabs_area(dem2di_slabs *slabs) {
    const dem2di_level *levels = dem2di_levels_sort(slabs->levels, slabs->count, slabs->ends);
    double area = 0;
    int count = 0, next = 0;
    double y = 0;
    while (next < slabs->count || count > 0) {
        double top = next < slabs->count ? levels[next].y : DBL_MAX;
        if (count == 0) y = top;
        for (; next < slabs->count && levels[next].y <= y; next++) {
            dem2di_strand *one = &slabs->strands[count++];
            one->rise = levels[next].rise;
            one->of = slabs->rises[one->rise].of;
            one->low = one->high = slabs->rises[one->rise].x;
        }
        top = next < slabs->count ? levels[next].y : DBL_MAX;
        for (int i = 0; i < count; i++)
            top = dem2di_min(top, slabs->rises[slabs->strands[i].rise].top);
        dem2di_strands_order(slabs, count, top);
        area += (top - y) * dem2di_slab_area(slabs->strands, count);
        y = top;
        count = dem2di_strands_advance(slabs, count, y);
    }
    return area;
}

/* Area inside exactly one of two outlines. */
static bool dem2di_difference_area(const dem2d_env *env, const dem2d_vec *a, int a_count,
                                   const dem2d_vec *b, int b_count, double *area) {
    dem2di_slabs slabs;
    size_t room = (size_t)a_count + (size_t)b_count, size = sizeof *slabs.rises;
    size += 2 * sizeof *slabs.levels + sizeof *slabs.strands + sizeof *slabs.ends;
    char *memory = (char *)dem2di_allocate(env, room, size), *next = memory;
    if (memory == NULL) return false;
    slabs.rises = (dem2di_rise *)dem2di_next_array(&next, room, sizeof *slabs.rises);
    slabs.levels = (dem2di_level *)dem2di_next_array(&next, 2 * room, sizeof *slabs.levels);
    slabs.strands = (dem2di_strand *)dem2di_next_array(&next, room, sizeof *slabs.strands);
    slabs.ends = (int *)dem2di_next_array(&next, room, sizeof *slabs.ends);
    slabs.count = 0;
    dem2di_slabs_add(&slabs, a, a_count, a[0], 0);
    dem2di_slabs_add(&slabs, b, b_count, a[0], 1);
    *area = dem2di_slabs_area(&slabs);
    dem2di_release(env, memory, room, size);
    return true;
}

/* --- Hausdorff distance ----------------------------------------------------------------------- */

/* Sides of an outline in groups of neighbours with a bounding box each. */
typedef struct dem2di_side_groups {
    dem2di_side *sides;
    dem2d_vec *boxes; /* low and high corner of each group */
    int count;
} dem2di_side_groups;

/* Sides in a group: a box costs about as much as a side, outlines have about 1000 sides, and the
   total cost is least near the square root of that. */
#define DEM2DI_GROUP 32

static void dem2di_side_groups_boxes(dem2di_side_groups *grouped) {
    for (int i = 0; i < grouped->count; i++) {
        dem2d_vec a = grouped->sides[i].a, b = dem2di_add(a, grouped->sides[i].e);
        dem2d_vec *box = &grouped->boxes[2 * (i / DEM2DI_GROUP)];
        if (i % DEM2DI_GROUP == 0) box[0] = box[1] = a;
        box[0].x = dem2di_min(box[0].x, dem2di_min(a.x, b.x));
        box[0].y = dem2di_min(box[0].y, dem2di_min(a.y, b.y));
        box[1].x = dem2di_max(box[1].x, dem2di_max(a.x, b.x));
        box[1].y = dem2di_max(box[1].y, dem2di_max(a.y, b.y));
    }
}

/* The side nearest to p, if its squared distance is below *square (that of side k), which it
   lowers. Stops when *square is at most `enough`. */
static int dem2di_side_groups_nearest(const dem2di_side_groups *grouped, dem2d_vec p, int k,
                                      double enough, double *square) {
    for (int start = 0; *square > enough && start < grouped->count; start += DEM2DI_GROUP) {
        const dem2d_vec *box = &grouped->boxes[2 * (start / DEM2DI_GROUP)];
        double x = dem2di_max(0, dem2di_max(box[0].x - p.x, p.x - box[1].x));
        double y = dem2di_max(0, dem2di_max(box[0].y - p.y, p.y - box[1].y));
        if (x * x + y * y >= *square) continue;
        int end = grouped->count - start > DEM2DI_GROUP ? start + DEM2DI_GROUP : grouped->count;
        for (int i = start; i < end; i++) {
            double found = dem2di_side_square(&grouped->sides[i], p);
            if (!(found < *square)) continue;
            *square = found;
            k = i;
        }
    }
    return k;
}

/* The greatest of `most` and the squared distances of corners from an outline. The search for the
   nearest side moves on from the last corner's; only if that leaves the distance above `most` are
   all sides searched. */
static double dem2di_side_groups_farthest(const dem2di_side_groups *grouped,
                                          const dem2di_side *corners, int count, double most) {
    int n = grouped->count, k = 0;
    for (int i = 0; i < count; i++) {
        dem2d_vec p = corners[i].a;
        double square = dem2di_side_square(&grouped->sides[k], p);
        for (int sense = 0; sense < 2; sense++)
            for (;;) {
                int next = sense == 0 ? (k + 1 < n ? k + 1 : 0) : (k > 0 ? k - 1 : n - 1);
                double found = dem2di_side_square(&grouped->sides[next], p);
                if (!(found < square)) break;
                square = found;
                k = next;
            }
        if (square > most) k = dem2di_side_groups_nearest(grouped, p, k, most, &square);
        most = dem2di_max(most, square);
    }
    return most;
}

/* Greatest distance of a corner of one outline from the other. */
static bool dem2di_hausdorff(const dem2d_env *env, const dem2d_vec *a, int a_count,
                             const dem2d_vec *b, int b_count, double *distance) {
    dem2di_side_groups grouped[2];
    size_t room = (size_t)a_count + (size_t)b_count;
    size_t size = sizeof(dem2di_side) + sizeof(dem2d_vec); /* fewer boxes than sides */
    dem2di_side *sides = (dem2di_side *)dem2di_allocate(env, room, size);
    if (sides == NULL) return false;
    dem2d_vec *boxes = (dem2d_vec *)(void *)(sides + room);
    grouped[0].sides = sides;
    grouped[0].boxes = boxes;
    grouped[0].count = dem2di_sides_make(a, a_count, a[0], sides);
    grouped[1].sides = sides + a_count;
    grouped[1].boxes = boxes + 2 * ((a_count - 1) / DEM2DI_GROUP + 1);
    grouped[1].count = dem2di_sides_make(b, b_count, a[0], grouped[1].sides);
    for (int i = 0; i < 2; i++) dem2di_side_groups_boxes(&grouped[i]);
    double most = dem2di_side_groups_farthest(&grouped[1], grouped[0].sides, grouped[0].count, 0);
    most = dem2di_side_groups_farthest(&grouped[0], grouped[1].sides, grouped[1].count, most);
    *distance = sqrt(most);
    dem2di_release(env, sides, room, size);
    return true;
}

DEM2D_API dem2d_result dem2d_outline_compare(const dem2d_env *env, const dem2d_vec *reference,
                                             int reference_count, const dem2d_vec *other,
                                             int other_count, dem2d_difference *difference) {
    dem2d_mass mass, unused;
    dem2d_difference found = {0, 0, 0};
    if (difference == NULL) return dem2di_fail_null(env, "difference");
    dem2d_result result = dem2di_check_outline(env, "reference", reference, reference_count, &mass);
    if (result == DEM2D_OK)
        result = dem2di_check_outline(env, "other", other, other_count, &unused);
    if (result != DEM2D_OK) return result;
    bool room =
        other_count < INT_MAX - reference_count &&
        dem2di_difference_area(env, reference, reference_count, other, other_count, &found.area) &&
        dem2di_hausdorff(env, reference, reference_count, other, other_count, &found.hausdorff);
    if (!room)
        return dem2di_fail(env, DEM2D_OUT_OF_MEMORY, -1,
                           "no memory for the difference of %d and %d points", reference_count,
                           other_count);
    found.coverage = 1 - found.area / mass.area;
    *difference = found;
    return DEM2D_OK;
}

/* ============================================================================================
   >>fitting  Templates from outlines, and virtual grains
   uses: config, math, memory, fields, hull, series, support, mass, shapes, outlines
   ============================================================================================ */

/* An outline prepared for a fit: counter-clockwise, relative to the centroid of its hull. */
typedef struct dem2di_outline {
    dem2d_vec *points; /* count */
    dem2d_vec *hull;   /* hull_count, counter-clockwise */
    int count, hull_count;
    dem2d_vec centre; /* what was subtracted */
    double radius;    /* of the circle with the hull's area */
} dem2di_outline;

static void dem2di_outline_release(const dem2d_env *env, dem2di_outline *outline) {
    dem2di_release(env, outline->points, 2 * (size_t)outline->count, sizeof(dem2d_vec));
}

/* With `simple` an outline that crosses itself is refused. */
static dem2d_result dem2di_outline_make(const dem2d_env *env, const dem2d_vec *points, int count,
                                        bool simple, dem2di_outline *outline) {
    dem2d_result result = dem2di_check_points(env, "points", points, count, 3);
    if (result != DEM2D_OK) return result;
    size_t n = (size_t)count;
    outline->count = count;
    outline->points = (dem2d_vec *)dem2di_allocate(env, 2 * n, sizeof(dem2d_vec));
    if (outline->points == NULL) return dem2di_fail_memory(env, count, "points of an outline");
    outline->hull = outline->points + count;
    result = dem2d_polygon_hull(env, points, count, outline->hull, &outline->hull_count);
    if (result == DEM2D_OK && simple) result = dem2di_check_crossing(env, "points", points, count);
    if (result != DEM2D_OK) {
        dem2di_outline_release(env, outline);
        return result;
    }
    dem2d_mass mass = dem2di_polygon_mass(outline->hull, outline->hull_count);
    outline->centre = mass.centroid;
    outline->radius = sqrt(mass.area / DEM2DI_PI);
    memcpy(outline->points, points, n * sizeof(dem2d_vec));
    if (dem2di_twice_area(points, count) < 0) dem2di_reverse(outline->points, count);
    for (int i = 0; i < count; i++)
        outline->points[i] = dem2di_sub(outline->points[i], outline->centre);
    for (int i = 0; i < outline->hull_count; i++)
        outline->hull[i] = dem2di_sub(outline->hull[i], outline->centre);
    return DEM2D_OK;
}

/* The hull's support corner in a direction, searched from a corner at or before it. */
static int dem2di_hull_climb(const dem2di_outline *outline, int k, dem2d_vec u) {
    int n = outline->hull_count;
    for (int i = 0; i < n; i++) {
        int next = k + 1 < n ? k + 1 : 0;
        if (dem2di_dot(dem2di_sub(outline->hull[next], outline->hull[k]), u) <= 0) break;
        k = next;
    }
    return k;
}

/* The support corner along +x, where sweeps of directions begin. */
static int dem2di_hull_start(const dem2di_outline *outline) {
    int best = 0;
    for (int k = 1; k < outline->hull_count; k++) {
        dem2d_vec gain = dem2di_sub(outline->hull[k], outline->hull[best]);
        if (gain.x > 0 || (gain.x == 0 && gain.y < 0)) best = k;
    }
    return best;
}

DEM2D_API dem2d_result dem2d_fourier_fit(const dem2d_env *env, const dem2d_vec *points, int count,
                                         int order, int samples, double *a, double *b) {
    if (a == NULL || b == NULL) return dem2di_fail_null(env, "a or b");
    dem2d_result result = dem2di_check_number(env, "order", order, DEM2DI_ORDER);
    if (result == DEM2D_OK)
        result =
            dem2di_check_number(env, "samples", samples, DEM2DI_WHOLE_OR_0(2 * order + 1, DBL_MAX));
    if (result != DEM2D_OK) return result;
    if (samples == 0) samples = 16 * order + 64;
    dem2di_outline outline;
    result = dem2di_outline_make(env, points, count, false, &outline);
    if (result != DEM2D_OK) return result;
    for (int n = 0; n <= order; n++) a[n] = b[n] = 0;
    int k = dem2di_hull_start(&outline);
    for (int i = 0; i < samples; i++) {
        dem2d_rot z = dem2d_rot_make(2 * DEM2DI_PI * i / samples);
        dem2d_vec u = dem2di_vec(z.c, z.s), power = dem2di_vec(1, 0);
        k = dem2di_hull_climb(&outline, k, u);
        double h = dem2di_dot(outline.hull[k], u) * 2 / samples;
        for (int n = 0; n <= order; n++) { /* with uniform samples, least squares is a sum */
            a[n] += h * power.x;
            b[n] += h * power.y;
            power = dem2di_turn(z, power);
        }
    }
    b[0] = 0;
    if (order >= 1) {
        a[1] += outline.centre.x;
        b[1] += outline.centre.y;
    }
    dem2di_outline_release(env, &outline);
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_fourier_convexity(const double *a, const double *b, int order,
                                               dem2d_convexity *convexity) {
    if (convexity == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_series(NULL, a, b, order);
    if (result == DEM2D_OK) *convexity = dem2di_convexity(a, b, order);
    return result;
}

static bool dem2di_test_holds(const double *a, const double *b, int order,
                              dem2d_convexity_test test) {
    if (test == DEM2D_NO_TEST) return true;
    dem2di_series radius = dem2di_series_make(a, b, order, true, 1);
    if (a[0] - radius.size >= 0) return true;
    return test == DEM2D_EXACT && dem2di_convexity(a, b, order).exact;
}

static const dem2di_field dem2di_reduction_fields[] = {
    DEM2DI_ROW(dem2d_reduction_desc, test, DEM2DI_CHOICE(DEM2D_NO_TEST + 1), "- SUFFICIENT"),
    DEM2DI_ROW(dem2d_reduction_desc, factor,
               DEM2DI_NUMBER(0, 1, DEM2DI_ABOVE | DEM2DI_BELOW | DEM2DI_OR_0), "- 0.9"),
    DEM2DI_ROW(dem2d_reduction_desc, tolerance, DEM2DI_FROM_0, "- 1e-6; relative to a0"),
};

DEM2D_API dem2d_result dem2d_fourier_reduce(double *a, double *b, int order,
                                            const dem2d_reduction_desc *desc, int *reductions) {
    dem2d_result result = dem2di_check_series(NULL, a, b, order);
    if (result != DEM2D_OK) return result;
    if (desc == NULL) return DEM2D_NULL_ARGUMENT;
    result = dem2di_check_fields(NULL, DEM2DI_ALL(dem2di_reduction_fields), desc);
    if (result != DEM2D_OK) return result;
    double factor = desc->factor == 0 ? 0.9 : desc->factor;
    double tolerance = desc->tolerance == 0 ? 1e-6 : desc->tolerance;
    int done = 0, n = order;
    double least = tolerance * a[0];
    while (!dem2di_test_holds(a, b, n, desc->test)) {
        while (n > 1 && dem2di_length(dem2di_vec(a[n], b[n])) <= least) {
            a[n] = b[n] = 0;
            n--;
        }
        if (n < 2) break; /* a circle */
        a[n] *= factor;
        b[n] *= factor;
        done++;
    }
    if (reductions != NULL) *reductions = done;
    return DEM2D_OK;
}

/* A knot of the polybezier: point, tangent, and its place in the outline. */
typedef struct dem2di_knot {
    dem2d_vec point, normal, tangent;
    int corner;    /* of the hull: the support corner, or the first corner of an edge */
    bool edge;     /* the knot is on the hull's edge from corner to the next, with its normal */
    bool straight; /* an end of a straight arc along that edge */
    int place;     /* index in the outline */
} dem2di_knot;

/* With an angle below this a direction counts as an edge's normal: tangent lines would meet the
   edge within 1e-6 of its length, and control points could not be distinguished. */
#define DEM2DI_EDGE_ANGLE 1e-6

static int dem2di_place_of(const dem2di_outline *outline, dem2d_vec point) {
    for (int i = 0; i < outline->count; i++)
        if (outline->points[i].x == point.x && outline->points[i].y == point.y) return i;
    return 0;
}

static dem2d_vec dem2di_hull_edge(const dem2di_outline *outline, int from) {
    return dem2di_sub(outline->hull[(from + 1) % outline->hull_count], outline->hull[from]);
}

/* A knot at a fraction of a hull's edge. It divides the outline below the edge between the arcs on
   both sides. */
static void dem2di_knot_on_edge(const dem2di_outline *outline, int from, double fraction,
                                dem2di_knot *knot) {
    dem2d_vec start = outline->hull[from], edge = dem2di_hull_edge(outline, from);
    int place = dem2di_place_of(outline, start);
    knot->edge = true;
    knot->corner = from;
    knot->point = dem2di_along(start, fraction, edge);
    for (int j = 0; j < outline->count; j++) {
        dem2d_vec q = outline->points[place];
        if (dem2di_dot(dem2di_sub(q, knot->point), edge) >= 0) break;
        place = (place + 1) % outline->count;
    }
    knot->place = place;
}

/* The knot at the support point in a direction, searched from a hull's corner at or before it; at
   an edge's middle if the direction is the edge's normal. Returns the support corner. */
static int dem2di_knot_make(const dem2di_outline *outline, int k, dem2d_vec normal,
                            dem2di_knot *knot) {
    int n = outline->hull_count;
    knot->normal = normal;
    knot->tangent = dem2di_perp(normal);
    knot->corner = k = dem2di_hull_climb(outline, k, normal);
    knot->edge = knot->straight = false;
    knot->point = outline->hull[k];
    knot->place = dem2di_place_of(outline, knot->point);
    for (int side = 0; side < 2 && !knot->edge; side++) {
        int from = side == 0 ? k : (k + n - 1) % n;
        dem2d_vec edge = dem2di_hull_edge(outline, from);
        if (fabs(dem2di_dot(edge, knot->normal)) <= DEM2DI_EDGE_ANGLE * dem2di_length(edge))
            dem2di_knot_on_edge(outline, from, 0.5, knot);
    }
    return k;
}

/* An edge of the hull that becomes a straight arc, and the curved arcs from it to the next one. */
typedef struct dem2di_straight {
    int edge; /* of the hull, from corner `edge` */
    double length;
    double turn; /* angle from its normal to that of the next straight edge */
    int arcs;    /* curved arcs that divide this angle */
} dem2di_straight;

static dem2d_vec dem2di_edge_normal(const dem2di_outline *outline, int from) {
    dem2d_vec unit = dem2di_vec(0, 0);
    (void)dem2di_unit(dem2di_hull_edge(outline, from), &unit);
    return dem2di_right(unit);
}

/* Distribute curved arcs over the turns between straight edges, which are sorted along the hull:
   one each, further ones where an arc turns most. False if an arc would turn by more than a third
   of a full turn, which three arcs without straight edges do. */
static bool dem2di_distribute_arcs(const dem2di_outline *outline, dem2di_straight *edges, int count,
                                   int arcs) {
    for (int j = 0; j < count; j++) {
        dem2d_vec from = dem2di_edge_normal(outline, edges[j].edge);
        dem2d_vec to = dem2di_edge_normal(outline, edges[(j + 1) % count].edge);
        edges[j].turn = count > 1 ? dem2di_angle(from, to) : 2 * DEM2DI_PI;
        if (edges[j].turn < 0) edges[j].turn += 2 * DEM2DI_PI;
        edges[j].arcs = 1;
    }
    for (int i = count; i <= arcs; i++) {
        int most = 0;
        for (int j = 1; j < count; j++)
            if (edges[j].turn * edges[most].arcs > edges[most].turn * edges[j].arcs) most = j;
        if (i == arcs) return edges[most].turn <= 2.1 * edges[most].arcs; /* just above 2 pi/3 */
        edges[most].arcs++;
    }
    return false; /* more edges than arcs */
}

/* Greatest length that rounding a corner cuts off its edges: a twentieth of the size. */
static double dem2di_corner_reach(const dem2di_outline *outline) {
    return 0.05 * outline->radius;
}

/* Knots in uniform directions; with straight edges, at both ends of each edge, and in uniform
   directions between them. */
static void dem2di_knots_make(const dem2di_outline *outline, int arcs, const dem2di_straight *sides,
                              int count, dem2di_knot *knots) {
    int k = dem2di_hull_start(outline);
    for (int i = 0; i < arcs && count == 0; i++)
        k = dem2di_knot_make(outline, k, dem2di_direction(i, arcs), &knots[i]);
    for (int j = 0; j < count; j++) {
        const dem2di_straight *side = &sides[j];
        dem2d_vec normal = dem2di_edge_normal(outline, side->edge);
        double cut = dem2di_min(0.25, dem2di_corner_reach(outline) / side->length);
        for (int end = 0; end < 2; end++, knots++) {
            knots->normal = normal;
            knots->tangent = dem2di_perp(normal);
            knots->straight = true;
            dem2di_knot_on_edge(outline, side->edge, end == 0 ? cut : 1 - cut, knots);
        }
        k = (side->edge + 1) % outline->hull_count;
        for (int i = 1; i < side->arcs; i++, knots++) {
            dem2d_rot turn = dem2d_rot_make(side->turn * i / side->arcs);
            k = dem2di_knot_make(outline, k, dem2di_turn(turn, normal), knots);
        }
    }
}

/* Distances from both ends of an arc to the point where its tangent lines meet. */
static void dem2di_tangent_lengths(const dem2di_knot *from, const dem2di_knot *to, double *l1,
                                   double *l2) {
    dem2d_vec chord = dem2di_sub(to->point, from->point);
    double sine = dem2di_cross(from->tangent, to->tangent);
    *l1 = dem2di_max(0, dem2di_cross(chord, to->tangent) / sine);
    *l2 = dem2di_max(0, dem2di_cross(from->tangent, chord) / sine);
}

/* If several directions had the same corner as support point, arcs would have no length. Their
   knots are moved onto a circle that touches the tangent lines of the first and the last direction
   at a distance `reach` from the corner. A knot in the middle of an edge stays there. */
static void dem2di_round_corner(const dem2di_outline *outline, dem2di_knot *knots, int arcs,
                                int first, int last, int low, int high) {
    dem2di_knot *start = &knots[low % arcs], *end = &knots[high % arcs];
    dem2d_vec corner = knots[first % arcs].point, bisector;
    double before, after, unused, reach = dem2di_corner_reach(outline);
    if (start->edge)
        before = dem2di_length(dem2di_sub(corner, start->point));
    else
        dem2di_tangent_lengths(&knots[(low + arcs - 1) % arcs], start, &unused, &before);
    if (end->edge)
        after = dem2di_length(dem2di_sub(corner, end->point));
    else
        dem2di_tangent_lengths(end, &knots[(high + 1) % arcs], &after, &unused);
    if (start->straight) before *= 2; /* a straight arc may end where the circle begins */
    if (end->straight) after *= 2;
    reach = dem2di_min(reach, dem2di_min(before, after) / 2);
    if (!dem2di_unit(dem2di_add(start->normal, end->normal), &bisector)) return;
    double cosine = dem2di_dot(bisector, start->normal); /* of half the angle */
    double sine = fabs(dem2di_cross(bisector, start->normal));
    double radius = reach * cosine / sine;
    dem2d_vec centre = dem2di_along(corner, -radius / cosine, bisector);
    for (int i = first; i <= last; i++)
        knots[i % arcs].point = dem2di_along(centre, radius, knots[i % arcs].normal);
    if (start->straight) start->point = dem2di_along(corner, -reach, start->tangent);
    if (end->straight) end->point = dem2di_along(corner, reach, end->tangent);
}

static void dem2di_round_corners(const dem2di_outline *outline, dem2di_knot *knots, int arcs) {
    int n = outline->hull_count, begin = 0;
    /* begin after a change of corner, so that no run continues past the end of the array */
    for (int i = 0; i < arcs; i++) {
        dem2di_knot *last = &knots[(i + arcs - 1) % arcs];
        if (knots[i].edge || last->edge || last->corner != knots[i].corner) begin = i;
    }
    for (int i = begin; i < begin + arcs;) {
        dem2di_knot *knot = &knots[i % arcs];
        int last = i, corner = knot->corner;
        if (knot->edge) {
            i++;
            continue;
        }
        while (last + 1 < begin + arcs && !knots[(last + 1) % arcs].edge &&
               knots[(last + 1) % arcs].corner == corner)
            last++;
        dem2di_knot *before = &knots[(i + arcs - 1) % arcs], *after = &knots[(last + 1) % arcs];
        int low = before->edge && (before->corner + 1) % n == corner ? i - 1 + arcs : i;
        int high = after->edge && after->corner == corner ? last + 1 : last;
        if (high > i || low != i) dem2di_round_corner(outline, knots, arcs, i, last, low, high);
        i = last + 1;
    }
}

/* One arc and the part of the outline between its knots, both relative to its first knot. */
typedef struct dem2di_section {
    const dem2di_outline *outline;
    const dem2di_knot *from, *to;
    double l1, l2;  /* tangent lengths */
    double rho_max; /* bound of the radius of curvature, m; HUGE_VAL: none */
    double bend;    /* bound of the curvature in the penalty, 1/m */
} dem2di_section;

static dem2di_arc dem2di_section_arc(const dem2di_section *section, double f1, double f2) {
    dem2di_arc arc;
    dem2d_vec chord = dem2di_sub(section->to->point, section->from->point);
    arc.start = dem2di_vec(0, 0);
    arc.d0 = dem2di_scale(section->from->tangent, f1 * section->l1);
    arc.d2 = dem2di_scale(section->to->tangent, f2 * section->l2);
    arc.d1 = dem2di_sub(chord, dem2di_add(arc.d0, arc.d2));
    return arc;
}

/* 1/2 int B x dB from t0 to t1: degree 5, so 3-point Gauss-Legendre is exact. */
static double dem2di_arc_sweep(const dem2di_arc *arc, double t0, double t1) {
    double half = (t1 - t0) / 2, sum = 0;
    for (int i = -1; i <= 1; i++) {
        double t = (t0 + t1) / 2 + i * half * 0.7745966692414833770; /* sqrt(3/5) */
        double weight = (i == 0 ? 8.0 : 5.0) / 9;
        sum += weight * dem2di_cross(dem2di_arc_point(arc, t), dem2di_arc_speed(arc, t));
    }
    return 1.5 * half * sum;
}

/* Distance (scaled) of an arc's point from a line, a cubic in the arc's parameter: its value at 0
   and its control differences. */
typedef struct dem2di_cubic {
    double start, q0, q1, q2;
} dem2di_cubic;

/* Of the line through p across a vector, times the vector's length. */
static dem2di_cubic dem2di_cubic_of(const dem2di_arc *arc, dem2d_vec p, dem2d_vec across) {
    dem2di_cubic f;
    f.start = dem2di_dot(across, dem2di_sub(arc->start, p));
    f.q0 = dem2di_dot(across, arc->d0);
    f.q1 = dem2di_dot(across, arc->d1);
    f.q2 = dem2di_dot(across, arc->d2);
    return f;
}

static double dem2di_cubic_value(const dem2di_cubic *f, double t) {
    return f->start + t * (3 - t * (3 - t)) * f->q0 + t * t * (3 - 2 * t) * f->q1 +
           t * t * t * f->q2;
}

static double dem2di_cubic_slope(const dem2di_cubic *f, double t) {
    double s = 1 - t;
    return 3 * (s * s * f->q0 + 2 * s * t * f->q1 + t * t * f->q2);
}

/* The zero between low and high, where the values have different signs: Newton's steps, or halving
   where they leave the bracket. 2^-40 of an arc is far below the error of any fit. */
static double dem2di_cubic_zero(const dem2di_cubic *f, double low, double high) {
    bool rising = dem2di_cubic_value(f, low) < 0;
    double t = (low + high) / 2;
    for (int i = 0; i < 60 && high - low > 1e-12; i++) {
        double value = dem2di_cubic_value(f, t);
        if ((value < 0) == rising)
            low = t;
        else
            high = t;
        double next = t - value / dem2di_cubic_slope(f, t);
        bool inside = next > low && next < high; /* false for a NaN */
        if (inside && fabs(next - t) < 1e-12) return next;
        t = inside ? next : (low + high) / 2;
    }
    return t;
}

/* Parameters where an arc crosses the segment p + [0, 1) edge, in the segment's order: at most two,
   as the arc is convex. The arc's point farthest along the segment's normal is between them. */
static int dem2di_arc_crossings(const dem2di_arc *arc, dem2d_vec p, dem2d_vec edge, double t[2]) {
    dem2d_vec normal = dem2di_perp(edge);
    dem2di_cubic f = dem2di_cubic_of(arc, p, normal);
    double square = dem2di_dot(edge, edge), place[2];
    double side[4] = {f.start, f.start + f.q0, f.start + f.q0 + f.q1, f.start + f.q0 + f.q1 + f.q2};
    bool above = side[0] > 0 && side[1] > 0 && side[2] > 0 && side[3] > 0;
    bool below = side[0] < 0 && side[1] < 0 && side[2] < 0 && side[3] < 0;
    if (above || below || square == 0) return 0;
    /* the edge's left normal if the arc bulges to the left, else the right one */
    if (f.q0 < 0 || f.q2 > 0) normal = dem2di_negate(normal);
    double split = dem2di_arc_parameter(dem2di_dot(arc->d0, normal), dem2di_dot(arc->d1, normal),
                                        dem2di_dot(arc->d2, normal));
    double ends[3] = {0, split, 1};
    int found = 0;
    for (int i = 0; i < 2; i++) {
        double a = dem2di_cubic_value(&f, ends[i]), b = dem2di_cubic_value(&f, ends[i + 1]);
        if ((a < 0) == (b < 0)) continue;
        double root = dem2di_cubic_zero(&f, ends[i], ends[i + 1]);
        double along = dem2di_dot(dem2di_sub(dem2di_arc_point(arc, root), p), edge) / square;
        if (along < 0 || along >= 1) continue;
        place[found] = along;
        t[found++] = root;
    }
    if (found == 2 && place[0] > place[1]) {
        double swap = t[0];
        t[0] = t[1];
        t[1] = swap;
    }
    return found;
}

/* Add the area between the arc from t0 to t1 and the outline, whose sweep is `loop`, and its
   derivatives by both fractions: the integrand dB x B' has degree 5 as well. */
static void dem2di_section_loop(const dem2di_section *section, const dem2di_arc *arc, double t0,
                                double t1, double loop, double *area, double slope[2]) {
    double sweep = dem2di_arc_sweep(arc, t0, t1) - loop, half = (t1 - t0) / 2;
    double sign = sweep < 0 ? -1 : 1;
    *area += fabs(sweep);
    for (int i = -1; i <= 1; i++) {
        double t = (t0 + t1) / 2 + i * half * 0.7745966692414833770, s = 1 - t; /* sqrt(3/5) */
        double weight = sign * half * (i == 0 ? 8.0 : 5.0) / 9;
        dem2d_vec speed = dem2di_arc_speed(arc, t);
        slope[0] +=
            weight * 9 * t * s * s * section->l1 * dem2di_cross(section->from->tangent, speed);
        slope[1] -=
            weight * 9 * t * t * s * section->l2 * dem2di_cross(section->to->tangent, speed);
    }
}

/* A point beside an arc: the parameter of the arc's point at the same place along the chord, and
   how far the point is outside of it across the chord. Only for arcs that go forward along the
   chord. */
typedef struct dem2di_foot {
    bool level; /* t and outside are known */
    double t, outside;
} dem2di_foot;

static dem2di_foot dem2di_arc_foot(const dem2di_arc *arc, dem2d_vec chord, dem2d_vec p, double t) {
    dem2di_foot foot = {false, t, 0};
    dem2di_cubic f = dem2di_cubic_of(arc, p, chord);
    double end = f.start + f.q0 + f.q1 + f.q2;
    if (f.q0 < 0 || f.q1 < 0 || f.q2 < 0 || f.start > 0 || end < 0) return foot;
    for (int i = 0; i < 8 && !foot.level; i++) {
        double value = dem2di_cubic_value(&f, t), slope = dem2di_cubic_slope(&f, t);
        double next = dem2di_max(0, dem2di_min(1, t - value / slope));
        foot.level = fabs(next - t) < 1e-6; /* the error is its square: below rounding errors */
        t = next;
    }
    foot.t = t;
    foot.outside = dem2di_cross(dem2di_sub(p, dem2di_arc_point(arc, t)), chord);
    return foot;
}

/* Can the segment between two points cross the arc? Not if both are inside (the arc is convex), nor
   if both are outside by more than the arc bulges between them, |B''| dt^2/8. */
static bool dem2di_may_cross(const dem2di_arc *arc, const dem2di_foot *a, const dem2di_foot *b) {
    if (!a->level || !b->level || (a->outside < 0) != (b->outside < 0)) return true;
    if (a->outside < 0) return false;
    double bend = dem2di_max(dem2di_length(dem2di_sub(arc->d1, arc->d0)),
                             dem2di_length(dem2di_sub(arc->d2, arc->d1)));
    double reach = b->t - a->t, bulge = 6 * bend * reach * reach / 8;
    /* measured across the chord it is longer by 1/cos of at most 60 degrees */
    return dem2di_min(a->outside, b->outside) <= 2 * bulge;
}

/* Number of samples of an arc's curvature, and a factor on the curvature asked for, so that the
   bound holds between the samples as well. */
#define DEM2DI_BEND_SAMPLES 32
#define DEM2DI_BEND_MARGIN 1.02

/* Penalty for arcs flatter than the bound, m2: the mean square of the missing fraction of the
   curvature, times the square of the chord: about the area that a flatter arc can gain. Adds its
   derivatives to slope. */
static double dem2di_section_penalty(const dem2di_section *section, const dem2di_arc *arc,
                                     double slope[2]) {
    dem2d_vec chord = dem2di_sub(section->to->point, section->from->point), d[2];
    double weight = dem2di_dot(chord, chord) / (DEM2DI_BEND_SAMPLES + 1), sum = 0;
    d[0] = dem2di_scale(section->from->tangent, section->l1);
    d[1] = dem2di_scale(section->to->tangent, section->l2);
    for (int i = 0; i <= DEM2DI_BEND_SAMPLES && section->bend > 0; i++) {
        double t = (double)i / DEM2DI_BEND_SAMPLES, s = 1 - t;
        dem2d_vec v = dem2di_arc_speed(arc, t);
        dem2d_vec a = dem2di_along(dem2di_scale(dem2di_sub(arc->d1, arc->d0), s), t,
                                   dem2di_sub(arc->d2, arc->d1));
        double square = dem2di_dot(v, v), turn = dem2di_cross(v, a);
        double unit = 1 / (1.5 * square * sqrt(square) * section->bend); /* see dem2di_arc_rho */
        double missing = DEM2DI_BEND_MARGIN - turn * unit;
        if (!(missing > 0) || !(square > 0)) continue;
        sum += missing * missing;
        for (int j = 0; j < 2; j++) {
            dem2d_vec dv = dem2di_scale(d[j], j == 0 ? s * s - 2 * t * s : t * t - 2 * t * s);
            dem2d_vec da = dem2di_scale(d[j], j == 0 ? t - 2 * s : 2 * t - s);
            double by = dem2di_cross(dv, a) + dem2di_cross(v, da);
            by -= 3 * turn * dem2di_dot(v, dv) / square;
            slope[j] -= 2 * weight * missing * unit * by;
        }
    }
    return weight * sum;
}

/* Number of points of a section: those of the outline between its knots, then the second knot. */
static int dem2di_section_count(const dem2di_section *section) {
    int count = section->outline->count;
    return (section->to->place - section->from->place + count) % count + 2;
}

/* Point i of count, relative to the first knot. */
static dem2d_vec dem2di_section_point(const dem2di_section *section, int i, int count) {
    const dem2di_outline *outline = section->outline;
    int place = (section->from->place + i) % outline->count;
    dem2d_vec p = i + 1 < count ? outline->points[place] : section->to->point;
    return dem2di_sub(p, section->from->point);
}

/* Area between arc and outline: their crossings divide both into loops, and the area of each loop
   is the difference of two sweeps. Exact if arc and outline pass the crossings in the same
   order. */
static double dem2di_section_area(const dem2di_section *section, const double f[2],
                                  double slope[2]) {
    dem2di_arc arc = dem2di_section_arc(section, f[0], f[1]);
    dem2d_vec chord = dem2di_vec(0, 0), p = dem2di_vec(0, 0);
    double area = 0, loop = 0, last = 0, t[2];
    int count = dem2di_section_count(section);
    dem2di_foot before = {false, 0, 0};
    slope[0] = slope[1] = 0;
    /* dem2di_arc_foot needs an arc within 60 degrees of its chord; a zero chord switches it off */
    (void)dem2di_unit(dem2di_sub(section->to->point, section->from->point), &chord);
    if (dem2di_dot(chord, section->from->tangent) < 0.5 ||
        dem2di_dot(chord, section->to->tangent) < 0.5)
        chord = dem2di_vec(0, 0);
    for (int i = 0; i < count; i++) {
        dem2d_vec q = dem2di_section_point(section, i, count);
        dem2di_foot here = dem2di_arc_foot(&arc, chord, q, before.t);
        bool cross = dem2di_may_cross(&arc, &before, &here);
        int found = cross ? dem2di_arc_crossings(&arc, p, dem2di_sub(q, p), t) : 0;
        before = here;
        for (int j = 0; j < found; j++) {
            dem2d_vec x = dem2di_arc_point(&arc, t[j]);
            loop += dem2di_cross(p, x) / 2;
            dem2di_section_loop(section, &arc, last, t[j], loop, &area, slope);
            last = t[j];
            loop = 0;
            p = x;
        }
        loop += dem2di_cross(p, q) / 2;
        p = q;
    }
    dem2di_section_loop(section, &arc, last, 1, loop, &area, slope);
    return area + dem2di_section_penalty(section, &arc, slope);
}

/* Fractions stay in [1e-4, 1]: 1e-4 keeps the tangents at the knots, 1 the control polygon
   convex. */
static double dem2di_fraction(double f) {
    return dem2di_max(1e-4, dem2di_min(1, f));
}

/* One step along -H slope, halved until the area falls; false if it does not within 2^-8. A
   fraction at its bound stays there if the step points outside. */
static bool dem2di_section_descend(const dem2di_section *section, double inverse[3], double f[2],
                                   double slope[2], double *area) {
    double d[2], g[2], next[2];
    d[0] = -(inverse[0] * slope[0] + inverse[1] * slope[1]);
    d[1] = -(inverse[1] * slope[0] + inverse[2] * slope[1]);
    for (int j = 0; j < 2; j++)
        if (dem2di_fraction(f[j] + d[j]) == f[j]) d[j] = 0;
    /* the expected decrease: 1e-5 of this area is about 1e-7 of the grain's */
    if (-(d[0] * slope[0] + d[1] * slope[1]) <= 1e-5 * *area) return false;
    for (double factor = 1; factor > 1.0 / 256; factor /= 2) {
        for (int j = 0; j < 2; j++) g[j] = dem2di_fraction(f[j] + factor * d[j]);
        double value = dem2di_section_area(section, g, next);
        if (!(value < *area)) continue;
        /* Broyden, Fletcher, Goldfarb, Shanno: H from the change of slopes */
        double s0 = g[0] - f[0], s1 = g[1] - f[1], y0 = next[0] - slope[0], y1 = next[1] - slope[1];
        double sy = s0 * y0 + s1 * y1;
        if (sy > 0) {
            double h0 = inverse[0] * y0 + inverse[1] * y1, h1 = inverse[1] * y0 + inverse[2] * y1;
            double scale = (1 + (y0 * h0 + y1 * h1) / sy) / sy;
            inverse[0] += scale * s0 * s0 - 2 * s0 * h0 / sy;
            inverse[1] += scale * s0 * s1 - (s0 * h1 + s1 * h0) / sy;
            inverse[2] += scale * s1 * s1 - 2 * s1 * h1 / sy;
        }
        memcpy(f, g, 2 * sizeof *f);
        memcpy(slope, next, 2 * sizeof *slope);
        *area = value;
        return true;
    }
    return false;
}

/* Least area over both fractions: quasi-Newton steps, restarted from the best place until a restart
   gains nothing. Returns the number of steps. */
static int dem2di_fit_section(const dem2di_section *section, double f[2]) {
    double slope[2], area = dem2di_section_area(section, f, slope);
    int steps = 0;
    for (int restart = 0; restart < 4; restart++) {
        double begin = area, steep = dem2di_length(dem2di_vec(slope[0], slope[1]));
        if (!(steep > 0)) break;
        double inverse[3];
        inverse[0] = inverse[2] = 0.1 / steep; /* a first step of a tenth of the lengths */
        inverse[1] = 0;
        for (int i = 0; i < 30; i++) {
            steps++;
            if (!dem2di_section_descend(section, inverse, f, slope, &area)) break;
        }
        if (begin - area <= 1e-6 * begin) break;
    }
    return steps;
}

/* Least area with a bound of the radius of curvature. A penalty does not enforce the bound exactly:
   while it does not hold, more curvature is asked for. If it never holds, the result is the arc
   with the least radius. Returns the number of steps. */
static int dem2di_fit_curved(dem2di_section *section, double f[2]) {
    double least = 0, g[2];
    int steps = 0;
    memcpy(g, f, sizeof g);
    for (int i = 0; i < 8; i++) { /* up to twice the curvature: 1.1^7 */
        steps += dem2di_fit_section(section, g);
        dem2di_arc arc = dem2di_section_arc(section, g[0], g[1]);
        double rho = dem2di_arc_rho_max(&arc, 0);
        if (i == 0 || rho < least) {
            least = rho;
            memcpy(f, g, sizeof g);
        }
        if (least <= section->rho_max) break;
        section->bend *= 1.1;
    }
    return steps;
}

/* ---- the paper's fit: particle swarm on the overlap of pixels ---- */

/* A random number in [0, 1) from a 64-bit counter: an odd step, and two multiplications with
   shifts between (S. Vigna's splitmix64). */
static double dem2di_random(uint64_t *state) {
    uint64_t x = *state += 0x9E3779B97F4A7C15u;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return (double)((x ^ (x >> 31)) >> 11) / 9007199254740992.0; /* 2^53 */
}

/* A picture of one section: pixels inside its outline, which the chord closes. */
typedef struct dem2di_raster {
    dem2d_vec lower;     /* corner of pixel (0, 0) */
    double pixel;        /* m */
    int width, height;   /* px */
    unsigned char *mask; /* height rows */
    unsigned char *row;  /* width + 1, scratch */
} dem2di_raster;

#define DEM2DI_SWARM_BIRDS 256 /* at most */
#define DEM2DI_SWARM_POINTS 48 /* chords of an arc: flatter than a pixel of the default size */

/* Draw one row of a closed polygon into raster->row. */
static void dem2di_raster_row(const dem2di_raster *raster, const dem2d_vec *points, int count,
                              int y) {
    double height = raster->lower.y + (y + 0.5) * raster->pixel;
    memset(raster->row, 0, (size_t)raster->width + 1);
    dem2d_vec p = points[count - 1];
    for (int i = 0; i < count; i++) {
        dem2d_vec q = points[i];
        if ((p.y <= height) != (q.y <= height)) {
            double x = p.x + (height - p.y) / (q.y - p.y) * (q.x - p.x);
            double column = ceil((x - raster->lower.x) / raster->pixel - 0.5);
            column = dem2di_max(0, dem2di_min(raster->width, column));
            raster->row[(int)column] ^= 1;
        }
        p = q;
    }
    for (int x = 1; x <= raster->width; x++) raster->row[x] ^= raster->row[x - 1];
}

/* Number of pixels where the arc's picture differs from the section's. */
static int dem2di_raster_cost(const dem2di_raster *raster, const dem2di_arc *arc) {
    dem2d_vec points[DEM2DI_SWARM_POINTS + 1];
    int cost = 0;
    for (int i = 0; i <= DEM2DI_SWARM_POINTS; i++)
        points[i] = dem2di_arc_point(arc, (double)i / DEM2DI_SWARM_POINTS);
    for (int y = 0; y < raster->height; y++) {
        const unsigned char *mask = raster->mask + (size_t)y * (size_t)raster->width;
        dem2di_raster_row(raster, points, DEM2DI_SWARM_POINTS + 1, y);
        for (int x = 0; x < raster->width; x++) cost += raster->row[x] != mask[x];
    }
    return cost;
}

/* The birds share their best place; inertia and attractions by M. Clerc and J. Kennedy's
   constriction for 2.05 + 2.05. */
static void dem2di_swarm_search(const dem2di_section *section, const dem2di_raster *raster,
                                const dem2d_fit_desc *swarm, uint64_t *random, double f[2]) {
    const double inertia = 0.7298437881283576, pull = 1.4961797656631331;
    struct {
        double x[2], v[2], best[2];
        double cost; /* px */
    } bird[DEM2DI_SWARM_BIRDS];
    double least = HUGE_VAL, unused[2] = {0, 0};
    memset(bird, 0, sizeof bird);
    for (int move = 0; move <= swarm->moves; move++)
        for (int i = 0; i < swarm->birds; i++) {
            for (int j = 0; j < 2; j++) {
                double r1 = dem2di_random(random), r2 = dem2di_random(random), *x = bird[i].x;
                bird[i].v[j] = inertia * bird[i].v[j] + pull * r1 * (bird[i].best[j] - x[j]) +
                               pull * r2 * (f[j] - x[j]);
                x[j] = dem2di_fraction(move == 0 ? r1 : x[j] + bird[i].v[j]);
                if (move == 0) bird[i].v[j] = 0;
            }
            dem2di_arc arc = dem2di_section_arc(section, bird[i].x[0], bird[i].x[1]);
            double cost = dem2di_section_penalty(section, &arc, unused);
            cost = cost / (raster->pixel * raster->pixel) + dem2di_raster_cost(raster, &arc);
            if (move == 0 || cost < bird[i].cost) {
                bird[i].cost = cost;
                memcpy(bird[i].best, bird[i].x, sizeof bird[i].best);
            }
            if (cost < least) {
                least = cost;
                memcpy(f, bird[i].x, 2 * sizeof *f);
            }
        }
}

/* [P] sec. 4 step 4 for one section. *arc is replaced unless the new arc is flatter than both the
   bound and *arc. iterations counts moves of the swarm. */
static dem2d_result dem2di_swarm_section(const dem2d_env *env, const dem2di_section *section,
                                         const dem2d_fit_desc *swarm, uint64_t *random,
                                         dem2di_arc *arc, int *iterations) {
    int inner = dem2di_section_count(section);
    dem2d_vec corner = dem2di_scale(section->from->tangent, section->l1);
    dem2d_box box = {{0, 0}, {0, 0}};
    dem2di_box_add(&box, corner);
    size_t count = (size_t)inner + 1;
    dem2d_vec *points = (dem2d_vec *)dem2di_allocate(env, count, sizeof *points);
    if (points == NULL)
        return dem2di_fail(env, DEM2D_OUT_OF_MEMORY, -1, "no memory for a picture of a section");
    points[0] = dem2di_vec(0, 0);
    for (int i = 0; i < inner; i++) {
        points[i + 1] = dem2di_section_point(section, i, inner);
        dem2di_box_add(&box, points[i + 1]);
    }
    dem2d_vec size = dem2di_sub(box.upper, box.lower);
    dem2di_raster raster;
    raster.lower = box.lower;
    raster.pixel = 2 * section->outline->radius / swarm->pixels;
    /* a needle may be much longer than the circle of its area: limit the number of pixels */
    raster.pixel = dem2di_max(raster.pixel, dem2di_max(size.x, size.y) / (8.0 * swarm->pixels));
    raster.width = (int)ceil(size.x / raster.pixel) + 1;
    raster.height = (int)ceil(size.y / raster.pixel) + 1;
    size_t width = (size_t)raster.width, pixels = width * (size_t)raster.height + width + 1;
    raster.mask = (unsigned char *)dem2di_allocate(env, pixels, 1);
    if (raster.mask != NULL) {
        raster.row = raster.mask + width * (size_t)raster.height;
        for (int y = 0; y < raster.height; y++) {
            dem2di_raster_row(&raster, points, (int)count, y);
            memcpy(raster.mask + (size_t)y * width, raster.row, width);
        }
        double f[2] = {0, 0};
        dem2di_swarm_search(section, &raster, swarm, random, f);
        dem2di_arc found = dem2di_section_arc(section, f[0], f[1]);
        double rho = dem2di_arc_rho_max(&found, 0);
        if (rho <= section->rho_max || rho <= dem2di_arc_rho_max(arc, 0)) *arc = found;
        *iterations += swarm->moves;
    }
    dem2di_release(env, points, count, sizeof *points);
    if (raster.mask == NULL)
        return dem2di_fail(env, DEM2D_OUT_OF_MEMORY, -1, "no memory for a picture of a section");
    dem2di_release(env, raster.mask, pixels, 1);
    return DEM2D_OK;
}

/* A candidate polybezier: knots, and the fractions of each arc. */
typedef struct dem2di_bezier_plan {
    const dem2di_outline *outline;
    int arcs, iterations;
    double rho_max;     /* bound of the radius of curvature, m; HUGE_VAL: none */
    dem2di_knot *knots; /* arcs */
    double *fractions;  /* 2 arcs */
    double area, rho;   /* result: area between arcs and outline, greatest radius */
} dem2di_bezier_plan;

static bool dem2di_plan_section(const dem2di_bezier_plan *plan, int i, dem2di_section *section) {
    section->outline = plan->outline;
    section->from = &plan->knots[i];
    section->to = &plan->knots[(i + 1) % plan->arcs];
    section->rho_max = plan->rho_max;
    section->bend = 1 / plan->rho_max;
    bool straight = section->from->straight && section->to->straight &&
                    section->from->corner == section->to->corner;
    if (straight)
        section->l1 = section->l2 =
            dem2di_length(dem2di_sub(section->to->point, section->from->point));
    else
        dem2di_tangent_lengths(section->from, section->to, &section->l1, &section->l2);
    return !straight;
}

/* Least area for the plan's knots. The search starts from the arcs of a circle, which have x/l =
   (4/3) tan(phi/4) / tan(phi/2) = (4/3) cos(phi/2) / (1 + cos(phi/2)). */
static void dem2di_plan_fit(dem2di_bezier_plan *plan) {
    double unused[2];
    plan->area = plan->rho = 0;
    for (int i = 0; i < plan->arcs; i++) {
        dem2di_section section;
        double *f = &plan->fractions[2 * i];
        f[0] = f[1] = 1.0 / 3; /* straight: constant speed */
        bool curved = dem2di_plan_section(plan, i, &section);
        if (curved) {
            double cosine = sqrt((1 + dem2di_dot(section.from->normal, section.to->normal)) / 2);
            f[0] = f[1] = 4.0 / 3 * cosine / (1 + cosine);
            plan->iterations += dem2di_fit_curved(&section, f);
        }
        dem2di_arc arc = dem2di_section_arc(&section, f[0], f[1]);
        if (curved) plan->rho = dem2di_arc_rho_max(&arc, plan->rho);
        section.bend = 0;
        plan->area += dem2di_section_area(&section, f, unused);
    }
}

/* Edges of the hull that may become straight arcs, the longest first, at most `room` >= 1 of them:
   those not shorter than a fifth of the size. Along a shorter edge, an arc with the greatest radius
   loses less than 1e-5 of the grain's area, L^3/(12 rho). Returns their number. */
static int dem2di_straight_find(const dem2di_outline *outline, dem2di_straight *sides, int room) {
    int count = 0;
    for (int k = 0; k < outline->hull_count; k++) {
        double length = dem2di_length(dem2di_hull_edge(outline, k));
        int i = count;
        if (length < 0.2 * outline->radius) continue;
        if (count < room)
            count++;
        else if (sides[--i].length >= length)
            continue;
        for (; i > 0 && sides[i - 1].length < length; i--) sides[i] = sides[i - 1];
        sides[i].edge = k;
        sides[i].length = length;
    }
    return count;
}

/* The first `count` edges found, sorted along the hull. */
static void dem2di_straight_sort(const dem2di_straight *found, int count, dem2di_straight *sides) {
    for (int i = 0; i < count; i++) {
        int j = i;
        for (; j > 0 && sides[j - 1].edge > found[i].edge; j--) sides[j] = sides[j - 1];
        sides[j] = found[i];
    }
}

/* Is a plan better than another? Plans that keep the bound are better than plans that do not. */
static bool dem2di_plan_better(const dem2di_bezier_plan *a, const dem2di_bezier_plan *b) {
    bool met_a = a->rho <= a->rho_max, met_b = b->rho <= b->rho_max;
    if (met_a && met_b) return a->area < b->area;
    return met_a != met_b ? met_a : a->rho < b->rho;
}

/* Fit plans with 0, 1, 2, ... straight edges, the longest first, and keep the best. */
static void dem2di_plan_search(dem2di_bezier_plan *plan, dem2di_bezier_plan *spare,
                               dem2di_straight *found, dem2di_straight *sides) {
    int room = plan->arcs - 3, count = 0;
    if (plan->rho_max < HUGE_VAL && room > 0)
        count = dem2di_straight_find(plan->outline, found, room);
    for (int straight = 0; straight <= count; straight++) {
        dem2di_straight_sort(found, straight, sides);
        if (straight > 0 &&
            !dem2di_distribute_arcs(plan->outline, sides, straight, plan->arcs - straight))
            continue;
        dem2di_knots_make(plan->outline, plan->arcs, sides, straight, spare->knots);
        dem2di_round_corners(plan->outline, spare->knots, plan->arcs);
        dem2di_plan_fit(spare);
        if (straight > 0 && !dem2di_plan_better(spare, plan)) continue;
        dem2di_bezier_plan swap = *plan;
        *plan = *spare;
        *spare = swap;
    }
}

/* [P] sec. 4 on a prepared outline, relative to its centre, by a swarm or (NULL) by exact area.
   rho_max bounds the radius of curvature; HUGE_VAL for none. */
static dem2d_result dem2di_bezier_fit(const dem2d_env *env, const dem2di_outline *outline, int arcs,
                                      double rho_max, const dem2d_fit_desc *swarm,
                                      dem2d_vec *control, int *iterations) {
    size_t count = (size_t)arcs;
    size_t size = sizeof(dem2di_knot) + sizeof(dem2di_straight) + 2 * sizeof(double);
    dem2di_knot *memory = (dem2di_knot *)dem2di_allocate(env, 2 * count, size);
    if (memory == NULL) return dem2di_fail_memory(env, arcs, "knots");
    dem2di_bezier_plan plan, spare;
    memset(&plan, 0, sizeof plan);
    plan.outline = outline;
    plan.arcs = arcs;
    plan.rho_max = rho_max;
    spare = plan;
    plan.knots = memory;
    spare.knots = memory + count;
    dem2di_straight *sides = (dem2di_straight *)(void *)(spare.knots + count);
    plan.fractions = (double *)(void *)(sides + 2 * count);
    spare.fractions = plan.fractions + 2 * count;
    dem2di_plan_search(&plan, &spare, sides, sides + count);
    dem2d_result result = DEM2D_OK;
    uint64_t random = swarm != NULL ? swarm->seed : 0;
    if (swarm == NULL) *iterations += plan.iterations + spare.iterations;
    for (int i = 0; i < arcs && result == DEM2D_OK; i++) {
        dem2di_section section;
        const double *f = &plan.fractions[2 * i];
        bool curved = dem2di_plan_section(&plan, i, &section);
        dem2di_arc arc = dem2di_section_arc(&section, f[0], f[1]);
        if (swarm != NULL && curved)
            result = dem2di_swarm_section(env, &section, swarm, &random, &arc, iterations);
        dem2d_vec knot = section.from->point;
        control[3 * i] = knot;
        control[3 * i + 1] = dem2di_add(knot, arc.d0);
        control[3 * i + 2] = dem2di_add(knot, dem2di_add(arc.d0, arc.d1));
    }
    dem2di_release(env, memory, 2 * count, size);
    return result;
}

/* Default bound of the radius of curvature of a fit, of the size. */
#define DEM2DI_FIT_RHO_MAX 20

DEM2D_API dem2d_result dem2d_bezier_fit(const dem2d_env *env, const dem2d_vec *points, int count,
                                        int arcs, dem2d_vec *control) {
    if (control == NULL) return dem2di_fail_null(env, "control");
    dem2d_result result = dem2di_check_number(env, "arcs", arcs, DEM2DI_WHOLE(3, 1 << 20));
    if (result != DEM2D_OK) return result;
    dem2di_outline outline;
    int iterations = 0;
    result = dem2di_outline_make(env, points, count, true, &outline);
    if (result != DEM2D_OK) return result;
    result = dem2di_bezier_fit(env, &outline, arcs, DEM2DI_FIT_RHO_MAX * outline.radius, NULL,
                               control, &iterations);
    for (int i = 0; i < 3 * arcs && result == DEM2D_OK; i++)
        control[i] = dem2di_add(control[i], outline.centre);
    dem2di_outline_release(env, &outline);
    return result;
}

/* Least objective by compass search: change each coordinate in turn by plus and minus its step;
   halve the steps when no change helps, until they are `least` of the first. Returns the number of
   calls. */
typedef double dem2di_objective_fn(void *data, const double *x);

static int dem2di_compass(dem2di_objective_fn *objective, void *data, double *x,
                          const double *steps, int count, double least) {
    double best = objective(data, x);
    int calls = 1;
    for (double factor = 1; factor > least;) {
        bool better = false;
        for (int i = 0; i < 2 * count; i++) {
            double old = x[i / 2];
            x[i / 2] += (i % 2 == 0 ? factor : -factor) * steps[i / 2];
            double value = objective(data, x);
            calls++;
            if (value < best) {
                best = value;
                better = true;
            } else {
                x[i / 2] = old;
            }
        }
        if (!better) factor /= 2;
    }
    return calls;
}

/* ---- Fourier series with rho >= margin: the nearest series in the mean square ---- */

/* Coefficients of a convex polygon's support function in closed form: rho has a Dirac peak with the
   length of each edge at its normal, and p_n = rho_n / (1 - n^2). n = 1 is the Steiner point, an
   integral over the normals at each corner. */
static void dem2di_hull_series(const dem2di_outline *outline, int order, double *a, double *b) {
    int n = outline->hull_count;
    for (int k = 0; k <= order; k++) a[k] = b[k] = 0;
    dem2d_vec last, unit;
    (void)dem2di_unit(dem2di_sub(outline->hull[0], outline->hull[n - 1]), &last);
    last = dem2di_right(last);
    for (int i = 0; i < n; i++) {
        dem2d_vec corner = outline->hull[i], edge = dem2di_sub(outline->hull[(i + 1) % n], corner);
        double length = dem2di_length(edge);
        (void)dem2di_unit(edge, &unit);
        dem2d_vec normal = dem2di_right(unit);
        dem2d_rot z = dem2di_rot(normal);
        double angle = dem2di_angle(last, normal);
        double sine = z.c * z.s - last.x * last.y; /* half the difference of sin(2 angle) */
        double cosine = last.x * last.x - last.y * last.y - z.c * z.c + z.s * z.s;
        dem2d_vec power = dem2di_vec(1, 0);
        a[0] += length / DEM2DI_PI;
        for (int k = 1; k <= order; k++) {
            power = dem2di_turn(z, power);
            double weight = k == 1 ? 0 : length / DEM2DI_PI / (1 - (double)k * k);
            a[k] += weight * power.x;
            b[k] += weight * power.y;
        }
        if (order >= 1) {
            a[1] += (corner.x * (angle + sine) + corner.y * cosine / 2) / (2 * DEM2DI_PI);
            b[1] += (corner.x * cosine / 2 + corner.y * (angle - sine)) / (2 * DEM2DI_PI);
        }
        last = normal;
    }
}

/* The search for the nearest series: angles where rho is constrained to the margin, and their
   multipliers. */
typedef struct dem2di_nearest_series {
    int order, count, room;
    double margin;         /* of a0/2 */
    const double *a0, *b0; /* unconstrained */
    double *a, *b;
    double *angle, *multiplier, *gap, *trial; /* room */
    double *matrix, *factor;                  /* room x room */
    bool *held;                               /* room: active, the multiplier may be above 0 */
} dem2di_nearest_series;

/* Scalar product of the constraints at two angles that differ by `angle`. The metric is the mean
   square of p, in which a0/2 counts twice as much as the other coefficients. */
static double dem2di_constraint_product(const dem2di_nearest_series *s, double angle) {
    dem2d_rot z = dem2d_rot_make(angle);
    dem2d_vec power = dem2di_vec(z.c, z.s);
    double sum = (1 - s->margin) * (1 - s->margin) / 2;
    for (int n = 2; n <= s->order; n++) {
        power = dem2di_turn(z, power);
        sum += (1 - (double)n * n) * (1 - (double)n * n) * power.x;
    }
    return sum;
}

/* a, b = unconstrained + sum of multipliers times constraints. */
static void dem2di_nearest_apply(dem2di_nearest_series *s) {
    memcpy(s->a, s->a0, ((size_t)s->order + 1) * sizeof *s->a);
    memcpy(s->b, s->b0, ((size_t)s->order + 1) * sizeof *s->b);
    for (int i = 0; i < s->count; i++) {
        if (s->multiplier[i] == 0) continue;
        dem2d_rot z = dem2d_rot_make(s->angle[i]);
        dem2d_vec power = dem2di_vec(z.c, z.s);
        s->a[0] += s->multiplier[i] * (1 - s->margin); /* twice the change of a0/2 */
        for (int n = 2; n <= s->order; n++) {
            power = dem2di_turn(z, power);
            s->a[n] += s->multiplier[i] * (1 - (double)n * n) * power.x;
            s->b[n] += s->multiplier[i] * (1 - (double)n * n) * power.y;
        }
    }
}

/* rho - margin a0/2 at an angle, and its slope. */
static double dem2di_slack(const dem2di_nearest_series *s, const double *a, const double *b,
                           double angle, double *slope) {
    double d[3], value;
    dem2di_series radius;
    memset(&radius, 0, sizeof radius);
    radius.a = a;
    radius.b = b;
    radius.order = s->order;
    radius.radius = true;
    radius.sign = 1;
    value = dem2di_series_value(&radius, angle, d);
    *slope = d[0];
    return value - s->margin * a[0] / 2;
}

/* Multipliers with which the slack of all active constraints is 0, by Cholesky factorisation row by
   row. A pivot within rounding errors belongs to a constraint that depends on the others: its
   multiplier is 0. */
static void dem2di_nearest_equal(dem2di_nearest_series *s, const bool *held, double *x) {
    int n = s->count, room = s->room;
    double *factor = s->factor;
    for (int i = 0; i < n; i++) {
        double *row = &factor[i * room];
        x[i] = held[i] ? -s->gap[i] : 0;
        for (int j = 0; j <= i; j++) {
            double sum = held[i] && held[j] ? s->matrix[i * room + j] : 0;
            for (int k = 0; k < j; k++) sum -= row[k] * factor[j * room + k];
            if (j < i) {
                row[j] = factor[j * room + j] > 0 ? sum / factor[j * room + j] : 0;
                x[i] -= row[j] * x[j];
            } else {
                row[i] = sum > 1e-12 * s->matrix[0] ? sqrt(sum) : 0; /* eps times a few hundred */
                x[i] = row[i] > 0 ? x[i] / row[i] : 0;
            }
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        double sum = x[i];
        for (int k = i + 1; k < n; k++) sum -= factor[k * room + i] * x[k];
        x[i] = factor[i * room + i] > 0 ? sum / factor[i * room + i] : 0;
    }
}

/* Multipliers >= 0 with which no constraint is violated (C. Lawson and R. Hanson, Solving Least
   Squares Problems, ch. 23): activate the most violated constraint; if a multiplier would become
   negative, go until it is 0 and deactivate its constraint. */
static void dem2di_nearest_solve(dem2di_nearest_series *s) {
    double unused, scale = s->a0[0], *x = s->trial;
    int n = s->count, last = -1;
    for (int i = 0; i < n; i++) {
        s->gap[i] = dem2di_slack(s, s->a0, s->b0, s->angle[i], &unused);
        for (int j = 0; j <= i; j++)
            s->matrix[i * s->room + j] = s->matrix[j * s->room + i] =
                dem2di_constraint_product(s, s->angle[i] - s->angle[j]);
        s->held[i] = s->multiplier[i] > 0;
    }
    for (int pass = 0; pass < 3 * n + 3; pass++) {
        for (int inner = 0; inner <= n; inner++) {
            double step = 1;
            dem2di_nearest_equal(s, s->held, x);
            for (int i = 0; i < n; i++)
                if (s->held[i] && x[i] <= 0) {
                    double change = s->multiplier[i] - x[i];
                    step = dem2di_min(step, change > 0 ? s->multiplier[i] / change : 0);
                }
            for (int i = 0; i < n; i++) {
                if (!s->held[i]) continue;
                s->multiplier[i] += step * (x[i] - s->multiplier[i]);
                if (x[i] > 0 || s->multiplier[i] > 1e-14 * scale) continue;
                s->multiplier[i] = 0;
                s->held[i] = false;
            }
            if (step == 1) break;
        }
        int worst = -1;
        double violation = -1e-11 * scale;
        for (int i = 0; i < n; i++) {
            if (s->held[i]) continue;
            double slack = s->gap[i];
            for (int j = 0; j < n; j++) slack += s->matrix[i * s->room + j] * s->multiplier[j];
            if (slack >= violation) continue;
            violation = slack;
            worst = i;
        }
        if (worst < 0 || worst == last) break; /* done, or just deactivated */
        s->held[worst] = true;
        last = worst;
    }
    dem2di_nearest_apply(s);
}

/* The minimum of the slack near a sample that is below its neighbours, by halving on its slope. */
static double dem2di_slack_minimum(const dem2di_nearest_series *s, double low, double high) {
    double slope;
    for (int i = 0; i < 40; i++) { /* 2^-40 of the spacing of samples */
        double middle = (low + high) / 2;
        (void)dem2di_slack(s, s->a, s->b, middle, &slope);
        if (slope < 0)
            low = middle;
        else
            high = middle;
    }
    return (low + high) / 2;
}

/* Add a constraint at an angle, or move an existing one that is within `near`. */
static void dem2di_constrain(dem2di_nearest_series *s, double angle, double near) {
    for (int i = 0; i < s->count; i++) {
        double apart = fabs(s->angle[i] - angle);
        if (dem2di_min(apart, 2 * DEM2DI_PI - apart) >= near) continue;
        s->angle[i] = angle;
        return;
    }
    if (s->count == s->room) return;
    s->angle[s->count] = angle;
    s->multiplier[s->count++] = 0;
}

/* Exchange of constraints: drop those with multiplier 0, add the minima of rho below the margin,
   until rho is nowhere below the margin by more than the tolerance. A new minimum replaces a nearby
   constraint, which converges fast. Where two constraints so close are needed this would cycle, so
   later minima are added. */
static int dem2di_nearest_search(dem2di_nearest_series *s) {
    int samples = 16 * s->order + 16, round = 0;
    double width = 2 * DEM2DI_PI / samples, slope;
    for (; round < 40; round++) {
        int kept = 0;
        double worst = 0, last, here, next;
        for (int i = 0; i < s->count; i++) {
            if (s->multiplier[i] == 0) continue;
            s->angle[kept] = s->angle[i];
            s->multiplier[kept++] = s->multiplier[i];
        }
        s->count = kept;
        last = dem2di_slack(s, s->a, s->b, -width, &slope);
        here = dem2di_slack(s, s->a, s->b, 0, &slope);
        for (int i = 0; i < samples; i++, last = here, here = next) {
            next = dem2di_slack(s, s->a, s->b, (i + 1) * width, &slope);
            if (here > last || here > next || here > 0.05 * s->a[0]) continue;
            double angle = dem2di_slack_minimum(s, (i - 1) * width, (i + 1) * width);
            double value = dem2di_slack(s, s->a, s->b, angle, &slope);
            worst = dem2di_min(worst, value);
            if (value < 0) dem2di_constrain(s, angle, (round < 20 ? 0.1 : 1e-3) * width);
        }
        if (worst >= -1e-5 * s->a[0]) break; /* a0 makes up for the rest */
        dem2di_nearest_solve(s);
    }
    return round;
}

/* Replace (a, b) by the nearest series with rho >= margin a0/2; order >= 2. */
static dem2d_result dem2di_constrain_series(const dem2d_env *env, double *a, double *b, int order,
                                            double margin, int *iterations) {
    dem2di_nearest_series s;
    s.order = order;
    s.margin = margin;
    s.count = 0;
    s.room = 8 * order + 16; /* at most `order` minima, with a few constraints each */
    size_t room = (size_t)s.room, terms = (size_t)order + 1;
    size_t cells = 2 * terms + 5 * room + 2 * room * room; /* the flags fit into the fifth */
    double *memory = (double *)dem2di_allocate(env, cells, sizeof *memory);
    if (memory == NULL) return dem2di_fail_memory(env, order, "terms");
    s.a0 = memory;
    s.b0 = memory + terms;
    memcpy(memory, a, terms * sizeof *memory);
    memcpy(memory + terms, b, terms * sizeof *memory);
    s.a = a;
    s.b = b;
    s.angle = memory + 2 * terms;
    s.multiplier = s.angle + room;
    s.gap = s.multiplier + room;
    s.trial = s.gap + room;
    s.matrix = s.trial + room;
    s.factor = s.matrix + room * room;
    s.held = (bool *)(void *)(s.factor + room * room);
    *iterations += dem2di_nearest_search(&s);
    dem2di_release(env, memory, cells, sizeof *memory);
    dem2di_series radius = dem2di_series_make(a, b, order, true, 1);
    double least = dem2di_series_minimum(&radius, DEM2DI_SERIES_TOLERANCE * radius.size).lower;
    double missing = margin * a[0] / 2 - least;
    if (missing > 0) a[0] += 2 * missing / (1 - margin);
    return DEM2D_OK;
}

/* ---- fits of all models, with a report ---- */

/* A fit of one of the models. */
typedef struct dem2di_fit {
    const dem2d_env *env;
    const dem2d_vec *points; /* as given */
    int point_count;
    dem2di_outline outline;
    dem2d_mass mass;             /* of the outline, about outline.centre */
    dem2d_fit_desc desc;         /* with defaults filled in */
    int count;                   /* of this attempt */
    dem2d_vec *buffer;           /* candidate outline: DEM2DI_FIT_POINTS */
    dem2d_result compare_result; /* of a comparison */
    dem2d_shape *shape;
    dem2d_fit_report report;
} dem2di_fit;

/* Points of a smooth candidate's outline; its area is too small by (2 pi/1440)^2/6 = 3e-6. */
#define DEM2DI_FIT_POINTS 1440

static void dem2di_fit_resize(const dem2di_fit *fit, double *a, double *b, int order) {
    double target = fit->desc.scale == DEM2D_SCALE_GRAIN
                        ? fit->mass.area
                        : dem2di_twice_area(fit->outline.hull, fit->outline.hull_count) / 2;
    if (fit->desc.scale == DEM2D_SCALE_NONE) return;
    double area = a[0] * a[0] / 4;
    for (int n = 2; n <= order; n++) area += (1 - (double)n * n) * (a[n] * a[n] + b[n] * b[n]) / 2;
    if (!(area > 0)) return; /* creation will refuse it */
    double factor = sqrt(target / (DEM2DI_PI * area));
    for (int n = 0; n <= order; n++) {
        if (n == 1) continue; /* about the Steiner point */
        a[n] *= factor;
        b[n] *= factor;
    }
}

static dem2d_result dem2di_fit_fourier(dem2di_fit *fit) {
    int order = fit->count;
    const dem2d_fit_desc *desc = &fit->desc;
    size_t terms = (size_t)order + 1;
    double *a = (double *)dem2di_allocate(fit->env, terms, 2 * sizeof *a);
    if (a == NULL) return dem2di_fail_memory(fit->env, order, "terms");
    double *b = a + terms;
    dem2d_result result = DEM2D_OK;
    dem2d_reduction_desc reduction;
    memset(&reduction, 0, sizeof reduction);
    int steps = 0;
    if (desc->method == DEM2D_FIT_REDUCTION || desc->method == DEM2D_FIT_REDUCTION_EXACT) {
        if (desc->method == DEM2D_FIT_REDUCTION_EXACT) reduction.test = DEM2D_EXACT;
        result =
            dem2d_fourier_fit(fit->env, fit->outline.points, fit->outline.count, order, 0, a, b);
        if (result == DEM2D_OK) result = dem2d_fourier_reduce(a, b, order, &reduction, &steps);
    } else {
        dem2di_hull_series(&fit->outline, order, a, b);
        for (int n = 2; n <= order && desc->method == DEM2D_FIT_FEJER; n++) {
            a[n] *= 1 - n / (order + 1.0);
            b[n] *= 1 - n / (order + 1.0);
        }
        if (desc->method != DEM2D_FIT_FEJER && order >= 2)
            result = dem2di_constrain_series(fit->env, a, b, order, desc->min_radius, &steps);
        if (result == DEM2D_OK) dem2di_fit_resize(fit, a, b, order);
    }
    fit->report.iterations += steps;
    if (result == DEM2D_OK) result = dem2d_shape_create_fourier(fit->env, a, b, order, &fit->shape);
    dem2di_release(fit->env, a, terms, 2 * sizeof *a);
    return result;
}

static dem2d_result dem2di_fit_bezier(dem2di_fit *fit) {
    size_t count = 3 * (size_t)fit->count;
    dem2d_vec *control = (dem2d_vec *)dem2di_allocate(fit->env, count, sizeof *control);
    if (control == NULL) return dem2di_fail_memory(fit->env, fit->count, "arcs");
    const dem2d_fit_desc *desc = &fit->desc;
    double rho_max = desc->unbounded ? HUGE_VAL : desc->max_radius * fit->outline.radius;
    dem2d_result result = dem2di_bezier_fit(fit->env, &fit->outline, fit->count, rho_max,
                                            desc->method == DEM2D_FIT_SWARM ? desc : NULL, control,
                                            &fit->report.iterations);
    if (result == DEM2D_OK)
        result = dem2d_shape_create_bezier(fit->env, control, fit->count, &fit->shape);
    dem2di_release(fit->env, control, count, sizeof *control);
    return result;
}

/* Difference of a candidate's outline from the grain's. */
static double dem2di_fit_difference(dem2di_fit *fit, const dem2d_vec *points, int count) {
    dem2d_difference difference;
    dem2d_result result = dem2d_outline_compare(fit->env, fit->outline.points, fit->outline.count,
                                                points, count, &difference);
    if (result == DEM2D_OK) return difference.area;
    fit->compare_result = result;
    return HUGE_VAL;
}

/* x is centre, half axes, angle. The polygon of 120 points would have 5e-4 less area than the
   ellipse: it is scaled to the ellipse's area. */
static double dem2di_ellipse_objective(void *data, const double *x) {
    const int count = 120;
    dem2di_fit *fit = (dem2di_fit *)data;
    if (!(x[2] > 0 && x[3] > 0)) return HUGE_VAL;
    dem2d_rot q = dem2d_rot_make(x[4]), step = dem2d_rot_make(2 * DEM2DI_PI / count);
    double swell = sqrt(2 * DEM2DI_PI / count / step.s);
    dem2d_vec z = dem2di_vec(1, 0), centre = dem2di_vec(x[0], x[1]);
    for (int i = 0; i < count; i++) {
        dem2d_vec p = dem2di_vec(swell * x[2] * z.x, swell * x[3] * z.y);
        fit->buffer[i] = dem2di_add(centre, dem2di_turn(q, p));
        z = dem2di_turn(step, z);
    }
    return dem2di_fit_difference(fit, fit->buffer, count);
}

/* The search starts from the ellipse with the area and second moments of the hull. */
static dem2d_result dem2di_fit_ellipse(dem2di_fit *fit) {
    double xx = 0, xy = 0, yy = 0, size = fit->outline.radius;
    const dem2d_vec *hull = fit->outline.hull;
    for (int i = 0; i < fit->outline.hull_count; i++) {
        dem2d_vec p = hull[i], q = hull[(i + 1) % fit->outline.hull_count];
        double sweep = dem2di_cross(p, q) / 12;
        xx += sweep * (p.x * p.x + p.x * q.x + q.x * q.x);
        yy += sweep * (p.y * p.y + p.y * q.y + q.y * q.y);
        xy += sweep * (p.x * p.y + q.x * q.y + (p.x * q.y + q.x * p.y) / 2);
    }
    dem2d_vec twice = dem2di_vec(xx - yy, 2 * xy);
    double root = dem2di_length(twice);
    double ratio = sqrt(sqrt((xx + yy + root) / (xx + yy - root)));
    double x[5] = {0, 0, size * ratio, size / ratio, dem2d_rot_angle(dem2di_rot(twice)) / 2};
    double steps[5] = {0.1 * size, 0.1 * size, 0.1 * size, 0.1 * size, 0.2};
    fit->report.iterations += dem2di_compass(dem2di_ellipse_objective, fit, x, steps, 5, 1e-3);
    if (fit->compare_result != DEM2D_OK) return fit->compare_result;
    fit->report.pose.position = dem2di_vec(x[0], x[1]);
    fit->report.pose.rotation = dem2d_rot_make(x[4]);
    return dem2d_shape_create_ellipse(fit->env, x[2], x[3], &fit->shape);
}

/* Is the polygon strictly convex, counter-clockwise? */
static bool dem2di_is_convex(const dem2d_vec *points, int count) {
    for (int i = 0; i < count; i++) {
        dem2d_vec a = dem2di_sub(points[(i + 1) % count], points[i]);
        dem2d_vec b = dem2di_sub(points[(i + 2) % count], points[(i + 1) % count]);
        double roundoff = 1e-6 * dem2di_length(a) * dem2di_length(b); /* a turn of 1e-6 rad */
        if (!(dem2di_cross(a, b) > roundoff)) return false;
    }
    return dem2di_turns_once(points, count);
}

static double dem2di_polygon_objective(void *data, const double *x) {
    dem2di_fit *fit = (dem2di_fit *)data;
    memcpy(fit->buffer, x, (size_t)fit->count * sizeof *fit->buffer);
    if (!dem2di_is_convex(fit->buffer, fit->count)) return HUGE_VAL;
    return dem2di_fit_difference(fit, fit->buffer, fit->count);
}

/* Corners of the hull are dropped one by one, each time the one with the smallest triangle with its
   neighbours; compass search then moves the remaining corners to the least difference. */
static dem2d_result dem2di_fit_polygon(dem2di_fit *fit) {
    int n = fit->outline.hull_count;
    if (n < fit->count) fit->count = n; /* the hull itself has fewer corners */
    size_t room = (size_t)n;
    dem2d_vec *corners = (dem2d_vec *)dem2di_allocate(fit->env, 2 * room, sizeof *corners);
    if (corners == NULL) return dem2di_fail_memory(fit->env, n, "corners");
    double *x = &corners->x, *steps = &corners[n].x;
    memcpy(corners, fit->outline.hull, room * sizeof *corners);
    for (; n > fit->count; n--) {
        int least = 0;
        double area = HUGE_VAL;
        for (int i = 0; i < n; i++) {
            dem2d_vec before = corners[(i + n - 1) % n], after = corners[(i + 1) % n];
            double lost = dem2di_cross(dem2di_sub(corners[i], before), dem2di_sub(after, before));
            if (lost >= area) continue;
            area = lost;
            least = i;
        }
        memmove(&corners[least], &corners[least + 1], (size_t)(n - 1 - least) * sizeof *corners);
    }
    for (int i = 0; i < 2 * n; i++) steps[i] = 0.1 * fit->outline.radius;
    fit->report.iterations += dem2di_compass(dem2di_polygon_objective, fit, x, steps, 2 * n, 1e-3);
    (void)dem2di_polygon_objective(fit, x);
    dem2di_release(fit->env, corners, 2 * room, sizeof *corners);
    if (fit->compare_result != DEM2D_OK) return fit->compare_result;
    return dem2d_shape_create_polygon(fit->env, fit->buffer, n, 0, &fit->shape);
}

/* One template of the model with fit->count, and its report. */
static dem2d_result dem2di_fit_once(dem2di_fit *fit) {
    dem2d_result result = DEM2D_OUT_OF_RANGE;
    fit->shape = NULL;
    fit->report.pose = dem2d_pose_make(fit->mass.centroid.x, fit->mass.centroid.y, 0, 1);
    if (fit->desc.model == DEM2D_CIRCLE)
        result = dem2d_shape_create_circle(fit->env, sqrt(fit->mass.area / DEM2DI_PI), &fit->shape);
    if (fit->desc.model == DEM2D_ELLIPSE) result = dem2di_fit_ellipse(fit);
    if (fit->desc.model == DEM2D_POLYGON) result = dem2di_fit_polygon(fit);
    if (fit->desc.model == DEM2D_BEZIER) result = dem2di_fit_bezier(fit);
    if (fit->desc.model == DEM2D_FOURIER) result = dem2di_fit_fourier(fit);
    if (result != DEM2D_OK) return result;
    const dem2d_shape *shape = fit->shape;
    bool placed = shape->type == DEM2D_CIRCLE || shape->type == DEM2D_ELLIPSE;
    if (!placed) fit->report.pose.position = shape->offset;
    int points = shape->type == DEM2D_POLYGON ? shape->count : DEM2DI_FIT_POINTS;
    (void)dem2d_shape_outline(shape, fit->report.pose, points, fit->buffer);
    dem2d_difference difference;
    result = dem2d_outline_compare(fit->env, fit->outline.points, fit->outline.count, fit->buffer,
                                   points, &difference);
    if (result != DEM2D_OK) {
        dem2d_shape_destroy(fit->shape);
        return result;
    }
    fit->report.count = fit->shape->count;
    fit->report.coverage = difference.coverage;
    fit->report.difference = difference.area;
    fit->report.hausdorff = difference.hausdorff;
    fit->report.convexity = shape->rho_min;
    fit->report.max_radius = shape->rho_max;
    return DEM2D_OK;
}

#define DEM2DI_FIT_COUNT 64 /* the greatest count tried for a coverage, see dem2d_outline_fit */

static const dem2di_field dem2di_fit_fields[] = {
    DEM2DI_ROW(dem2d_fit_desc, count, DEM2DI_WHOLE(0, 1024), "- coverage; 3 for polygon, bezier"),
    DEM2DI_ROW(dem2d_fit_desc, coverage, DEM2DI_FROM_0, "- none; in (0, 1) if count is 0"),
    DEM2DI_ROW(dem2d_fit_desc, model, DEM2DI_CHOICE(DEM2D_CUSTOM), "- CIRCLE; not CUSTOM"),
    DEM2DI_ROW(dem2d_fit_desc, method, DEM2DI_CHOICE(DEM2D_FIT_SWARM + 1),
               "- DEFAULT; of the model"),
    DEM2DI_ROW(dem2d_fit_desc, scale, DEM2DI_CHOICE(DEM2D_SCALE_NONE + 1), "- HULL"),
    DEM2DI_ROW(dem2d_fit_desc, min_radius, DEM2DI_FRACTION, "- 0.1; of a0/2"),
    DEM2DI_ROW(dem2d_fit_desc, corners, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_fit_desc, max_radius, DEM2DI_NUMBER(1, DBL_MAX, DEM2DI_OR_0),
               "- 20; of the size"),
    DEM2DI_ROW(dem2d_fit_desc, unbounded, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_fit_desc, seed, DEM2DI_WORD, "- 0"),
    DEM2DI_ROW(dem2d_fit_desc, birds, DEM2DI_WHOLE_OR_0(2, DEM2DI_SWARM_BIRDS), "- 30"),
    DEM2DI_ROW(dem2d_fit_desc, moves, DEM2DI_WHOLE(0, 100000), "- 60"),
    DEM2DI_ROW(dem2d_fit_desc, pixels, DEM2DI_WHOLE_OR_0(8, 4096), "px 256"),
};

static dem2d_result dem2di_check_fit(const dem2d_env *env, const dem2d_fit_desc *desc) {
    static const int least[DEM2D_SHAPE_TYPE_COUNT] = {0, 0, 3, 3, 1, 0};
    dem2d_fit_method method = desc->method;
    bool bezier = method == DEM2D_FIT_AREA || method == DEM2D_FIT_SWARM;
    dem2d_result result = dem2di_check_fields(env, DEM2DI_ALL(dem2di_fit_fields), desc);
    if (result != DEM2D_OK) return result;
    if (method != DEM2D_FIT_DEFAULT && desc->model != (bezier ? DEM2D_BEZIER : DEM2D_FOURIER))
        return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "method = %d is not one of the model's",
                           (int)method);
    if (least[desc->model] == 0) return DEM2D_OK;
    if (desc->count == 0 && desc->coverage > 0)
        return dem2di_check_number(env, "coverage", desc->coverage, DEM2DI_FRACTION);
    return dem2di_check_number(env, "count", desc->count, DEM2DI_WHOLE(least[desc->model], 1024));
}

static dem2d_fit_desc dem2di_fit_defaults(dem2d_fit_desc desc) {
    if (desc.min_radius == 0) desc.min_radius = 0.1;
    if (desc.corners) desc.min_radius = 0;
    if (desc.max_radius == 0) desc.max_radius = DEM2DI_FIT_RHO_MAX;
    if (desc.birds == 0) desc.birds = 30;
    if (desc.moves == 0) desc.moves = 60;
    if (desc.pixels == 0) desc.pixels = 256;
    return desc;
}

/* The fit with the given count, or with the least one that reaches the coverage. */
static dem2d_result dem2di_fit_counts(dem2di_fit *fit) {
    const dem2d_fit_desc *desc = &fit->desc;
    bool counted = desc->model != DEM2D_CIRCLE && desc->model != DEM2D_ELLIPSE;
    fit->count = desc->count;
    if (!counted || desc->count > 0) return dem2di_fit_once(fit);
    for (int count = desc->model == DEM2D_FOURIER ? 1 : 3; count <= DEM2DI_FIT_COUNT; count++) {
        fit->count = count;
        dem2d_result result = dem2di_fit_once(fit);
        if (result != DEM2D_OK || fit->report.coverage >= desc->coverage) return result;
        dem2d_shape_destroy(fit->shape);
    }
    return dem2di_fail(fit->env, DEM2D_NOT_REACHED, -1,
                       "coverage = %g is not reached, but %g with count %d", desc->coverage,
                       fit->report.coverage, DEM2DI_FIT_COUNT);
}

DEM2D_API dem2d_result dem2d_outline_fit(const dem2d_env *env, const dem2d_vec *points, int count,
                                         const dem2d_fit_desc *desc, dem2d_shape **shape,
                                         dem2d_fit_report *report) {
    if (desc == NULL || shape == NULL) return dem2di_fail_null(env, "desc or shape");
    dem2d_result result = dem2di_check_fit(env, desc);
    if (result != DEM2D_OK) return result;
    dem2di_fit fit;
    memset(&fit, 0, sizeof fit);
    fit.env = env;
    fit.desc = dem2di_fit_defaults(*desc);
    result = dem2di_outline_make(env, points, count, true, &fit.outline);
    if (result != DEM2D_OK) return result;
    double turn = dem2di_twice_area(fit.outline.points, count);
    size_t room = DEM2DI_FIT_POINTS;
    fit.buffer = (dem2d_vec *)dem2di_allocate(env, room, sizeof *fit.buffer);
    if (!(turn > DEM2DI_ROUNDOFF * fit.outline.radius * fit.outline.radius)) {
        result = dem2di_fail(env, DEM2D_ZERO_AREA, -1, "the outline's area is %g", turn / 2);
    } else if (fit.buffer == NULL) {
        result = dem2di_fail_memory(env, DEM2DI_FIT_POINTS, "points of a candidate");
    } else {
        fit.mass = dem2di_polygon_mass(fit.outline.points, count);
        result = dem2di_fit_counts(&fit);
    }
    if (result == DEM2D_OK) {
        fit.report.pose.position = dem2di_add(fit.report.pose.position, fit.outline.centre);
        fit.shape->offset = dem2di_vec(0, 0); /* report.pose is relative to the centroid */
        *shape = fit.shape;
        if (report != NULL) *report = fit.report;
    }
    dem2di_release(env, fit.buffer, room, sizeof *fit.buffer);
    dem2di_outline_release(env, &fit.outline);
    return result;
}

/* Distance from the centre to the outermost crossing of the outline with a ray along u. */
static double dem2di_ray_reach(const dem2d_vec *points, int count, dem2d_vec centre, dem2d_vec u) {
    double reach = 0;
    dem2d_vec p = dem2di_sub(points[count - 1], centre);
    for (int i = 0; i < count; i++) {
        dem2d_vec q = dem2di_sub(points[i], centre);
        double sp = dem2di_cross(u, p), sq = dem2di_cross(u, q);
        if ((sp <= 0) != (sq <= 0)) {
            double along = dem2di_dot(u, p) + sp / (sp - sq) * dem2di_dot(u, dem2di_sub(q, p));
            reach = dem2di_max(reach, along);
        }
        p = q;
    }
    return reach;
}

DEM2D_API dem2d_result dem2d_radial_compare(const dem2d_env *env, const dem2d_vec *points,
                                            int count, int order, dem2d_difference *difference) {
    const int rays = DEM2DI_FIT_POINTS;
    if (difference == NULL) return dem2di_fail_null(env, "difference");
    dem2d_mass mass;
    dem2d_result result = dem2di_check_good_outline(env, "points", points, count, &mass);
    if (result != DEM2D_OK) return result;
    result = dem2di_check_number(env, "order", order, DEM2DI_WHOLE(0, (rays - 1) / 2));
    if (result != DEM2D_OK) return result;
    dem2d_vec *fitted = (dem2d_vec *)dem2di_allocate(env, 2 * (size_t)rays, sizeof *fitted);
    if (fitted == NULL) return dem2di_fail_memory(env, rays, "rays");
    double *r = (double *)(void *)(fitted + rays), *sum = r + rays;
    for (int i = 0; i < rays; i++) {
        r[i] = dem2di_ray_reach(points, count, mass.centroid, dem2di_direction(i, rays));
        sum[i] = 0;
    }
    for (int n = 0; n <= order; n++) {
        dem2d_rot step = dem2d_rot_make(2 * DEM2DI_PI * n / rays);
        dem2d_vec z = dem2di_vec(1, 0), c = dem2di_vec(0, 0);
        for (int i = 0; i < rays; i++, z = dem2di_turn(step, z))
            c = dem2di_along(c, r[i] * (n == 0 ? 1.0 : 2.0) / rays, z);
        z = dem2di_vec(1, 0);
        for (int i = 0; i < rays; i++, z = dem2di_turn(step, z)) sum[i] += dem2di_dot(c, z);
    }
    for (int i = 0; i < rays; i++)
        fitted[i] = dem2di_along(mass.centroid, dem2di_max(0, sum[i]), dem2di_direction(i, rays));
    result = dem2d_outline_compare(env, points, count, fitted, rays, difference);
    dem2di_release(env, fitted, 2 * (size_t)rays, sizeof *fitted);
    return result;
}

/* ---- virtual grains ---- */

static double dem2di_virtual_amplitude(const dem2d_virtual_desc *desc, int n) {
    if (desc->spectrum != NULL) return desc->spectrum[n];
    if (n == 2) return desc->elongation;
    return n < 8 ? desc->roundness * 9 / ((double)n * n) : desc->roughness * 64 / ((double)n * n);
}

static const dem2di_field dem2di_virtual_fields[] = {
    DEM2DI_ROW(dem2d_virtual_desc, radius, DEM2DI_POSITIVE, "m none"),
    DEM2DI_ROW(dem2d_virtual_desc, elongation, DEM2DI_FROM_0, "- 0"),
    DEM2DI_ROW(dem2d_virtual_desc, roundness, DEM2DI_FROM_0, "- 0"),
    DEM2DI_ROW(dem2d_virtual_desc, roughness, DEM2DI_FROM_0, "- 0"),
    DEM2DI_ROW(dem2d_virtual_desc, spectrum, DEM2DI_OPTIONAL, "- NULL; order + 1 values >= 0"),
    DEM2DI_ROW(dem2d_virtual_desc, min_radius, DEM2DI_FRACTION, "- 0.1; of a0/2"),
    DEM2DI_ROW(dem2d_virtual_desc, seed, DEM2DI_WORD, "- 0"),
};

static dem2d_result dem2di_check_virtual(const dem2d_virtual_desc *desc, int order) {
    dem2d_result result = dem2di_check_fields(NULL, DEM2DI_ALL(dem2di_virtual_fields), desc);
    if (result == DEM2D_OK) result = dem2di_check_number(NULL, "order", order, DEM2DI_ORDER);
    if (result != DEM2D_OK) return result;
    for (int n = 2; desc->spectrum != NULL && n <= order; n++) {
        if (!dem2di_finite(desc->spectrum[n])) return DEM2D_NOT_FINITE;
        if (desc->spectrum[n] < 0) return DEM2D_OUT_OF_RANGE;
    }
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_fourier_virtual(const dem2d_virtual_desc *desc, int order, double *a,
                                             double *b) {
    if (desc == NULL || a == NULL || b == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_virtual(desc, order);
    if (result != DEM2D_OK) return result;
    uint64_t state = desc->seed;
    double margin = desc->min_radius == 0 ? 0.1 : desc->min_radius;
    for (int n = 0; n <= order; n++) {
        dem2d_rot phase = dem2d_rot_make(2 * DEM2DI_PI * dem2di_random(&state));
        double amplitude = n < 2 ? 0 : dem2di_virtual_amplitude(desc, n);
        a[n] = amplitude * phase.c;
        b[n] = n == 0 ? 0 : amplitude * phase.s;
    }
    /* with a0/2 = 1 the series gives rho - 1: its minimum times the common factor must not be below
       margin - 1 */
    dem2di_series radius = dem2di_series_make(a, b, order, true, 1);
    double least = dem2di_series_minimum(&radius, 1e-12 * radius.size).lower;
    double factor = -least > 1 - margin ? (1 - margin) / -least : 1, area = 1;
    for (int n = 2; n <= order; n++) {
        a[n] *= factor;
        b[n] *= factor;
        area += (1 - (double)n * n) * (a[n] * a[n] + b[n] * b[n]) / 2;
    }
    double size = desc->radius / sqrt(area);
    a[0] = 2 * size;
    for (int n = 2; n <= order; n++) {
        a[n] *= size;
        b[n] *= size;
    }
    return DEM2D_OK;
}

/* ============================================================================================
   >>gjk  Distance of two shapes, or a proof that they overlap: Gilbert-Johnson-Keerthi
   uses: config, math, support
   ============================================================================================ */

/* Two shapes relative to the centre of A: their difference A minus B minus d has the support value
   h(u) = h_A(u) + h_B(-u) - d.u. */
typedef struct dem2di_pair {
    const dem2d_shape *a, *b;
    dem2d_rot ra, rb;
    double scale_a, scale_b;
    dem2d_vec d;     /* centre of A to centre of B */
    double distance; /* |d| */
    double size;     /* R_A + R_B + |d|: rounding errors are relative to it */
    int calls;       /* evaluations of the support function */
} dem2di_pair;

/* A point w of A minus B minus d, and the points a and b that it comes from, each relative to its
   own centre. */
typedef struct dem2di_vertex {
    dem2d_vec w, a, b;
} dem2di_vertex;

/* The features of two polygons in contact: an edge of one and a corner of the other, or two
   corners. */
typedef struct dem2di_feature {
    int own;       /* whose edge: 0 for A, 1 for B; -1: none, or not known */
    int corner[2]; /* of A and B: the corner, or the first corner of the edge; -1: not known */
} dem2di_feature;

/* State and result of a search: h(normal) = upper is the least support value found, the true depth
   is not below lower; a and b are the witness points. */
typedef struct dem2di_search {
    dem2d_contact_state state;
    int iterations;
    int count;                /* vertices of the simplex */
    dem2di_vertex simplex[3]; /* of GJK; contains the origin if the shapes overlap */
    dem2d_vec normal;
    double upper, lower;
    double residual; /* of EPA */
    dem2d_vec a, b;
    dem2d_proof proof;
    dem2di_feature feature;
    bool alone; /* two polygons have no second contact point: see dem2di_corner_alone */
} dem2di_search;

/* From centre a to centre b: the only place that a periodic cell would change. */
static dem2d_vec dem2di_centre_line(dem2d_vec a, dem2d_vec b) {
    return dem2di_sub(b, a);
}

static inline void dem2di_pair_set(const dem2d_shape *a, const dem2d_pose *pose_a,
                                   const dem2d_shape *b, const dem2d_pose *pose_b,
                                   dem2di_pair *pair) {
    pair->a = a;
    pair->b = b;
    pair->ra = pose_a->rotation;
    pair->rb = pose_b->rotation;
    pair->scale_a = pose_a->scale;
    pair->scale_b = pose_b->scale;
    pair->d = dem2di_centre_line(pose_a->position, pose_b->position);
    pair->distance = dem2di_length(pair->d);
    pair->size = a->circumscribed * pair->scale_a + b->circumscribed * pair->scale_b;
    pair->size += pair->distance;
    pair->calls = 0;
}

static dem2di_pair dem2di_pair_make(const dem2d_shape *a, const dem2d_pose *pose_a,
                                    const dem2d_shape *b, const dem2d_pose *pose_b) {
    dem2di_pair pair;
    dem2di_pair_set(a, pose_a, b, pose_b, &pair);
    return pair;
}

/* The vertex of two support points. Written through a pointer: a returned struct would be read in
   wider pieces than it was written in, which stalls the processor. */
static inline void dem2di_vertex_set(const dem2di_pair *pair, dem2d_vec a, dem2d_vec b,
                                     dem2di_vertex *v) {
    v->a = a;
    v->b = b;
    v->w.x = (a.x - b.x) - pair->d.x;
    v->w.y = (a.y - b.y) - pair->d.y;
}

/* Support point of A minus B minus d; rho (may be NULL) gets the radii of curvature of A and B. */
static inline void dem2di_minkowski(dem2di_pair *pair, dem2d_vec u, double rho[2],
                                    dem2di_vertex *v) {
    double *rho_a = rho, *rho_b = rho != NULL ? rho + 1 : NULL;
    dem2d_vec a = dem2di_support(pair->a, dem2di_turn_back(pair->ra, u), rho_a);
    dem2d_vec b = dem2di_support(pair->b, dem2di_turn_back(pair->rb, dem2di_negate(u)), rho_b);
    if (rho != NULL) rho[0] *= pair->scale_a, rho[1] *= pair->scale_b;
    pair->calls++;
    dem2di_vertex_set(pair, dem2di_scale(dem2di_turn(pair->ra, a), pair->scale_a),
                      dem2di_scale(dem2di_turn(pair->rb, b), pair->scale_b), v);
}

/* Direction of the line of centres; (1, 0) for concentric shapes. */
static dem2d_vec dem2di_centres(const dem2di_pair *pair) {
    dem2d_vec u = dem2di_vec(1, 0);
    (void)dem2di_unit(pair->d, &u);
    return u;
}

/* Distance of the origin from the segment v[0] v[1], and the unit direction from the nearest point
   to the origin. Inside the segment this is the segment's normal, which stays accurate as the
   distance goes to 0. If an end is nearest, the other one is dropped. */
static double dem2di_nearest(dem2di_vertex *v, int *count, dem2d_vec *direction) {
    dem2d_vec edge = dem2di_sub(v[1].w, v[0].w);
    double before = dem2di_dot(v[0].w, edge), after = dem2di_dot(v[1].w, edge);
    if (*count == 2 && before < 0 && after > 0) {
        double length = dem2di_length(edge), moment = dem2di_cross(v[0].w, edge);
        dem2d_vec normal = dem2di_scale(dem2di_perp(edge), 1 / length);
        *direction = moment > 0 ? normal : dem2di_negate(normal);
        return fabs(moment) / length;
    }
    if (*count == 2 && before < 0) v[0] = v[1];
    *count = 1;
    *direction = dem2di_vec(1, 0);
    if (dem2di_unit(v[0].w, direction)) *direction = dem2di_negate(*direction);
    return dem2di_length(v[0].w);
}

/* Is the origin in the triangle, boundary included? */
static bool dem2di_triangle_holds(const dem2di_vertex *v) {
    double ab = dem2di_cross(v[0].w, v[1].w), bc = dem2di_cross(v[1].w, v[2].w);
    double ca = dem2di_cross(v[2].w, v[0].w);
    if (ab == 0 && bc == 0 && ca == 0) return false; /* all on one line with the origin */
    return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

/* Add a vertex to the simplex, and reduce it to the part nearest to the origin. True if the simplex
   contains the origin. */
static bool dem2di_simplex_add(dem2di_search *search, dem2di_vertex v, double *distance,
                               dem2d_vec *direction) {
    dem2di_vertex *simplex = search->simplex;
    if (search->count < 2) {
        simplex[1] = v;
        search->count = 2;
        *distance = dem2di_nearest(simplex, &search->count, direction);
        return false;
    }
    simplex[2] = v;
    if (dem2di_triangle_holds(simplex)) {
        search->count = 3;
        return true;
    }
    dem2di_vertex first[2], second[2];
    dem2d_vec direction_first, direction_second;
    int count_first = 2, count_second = 2;
    first[0] = simplex[0], first[1] = v;
    second[0] = simplex[1], second[1] = v;
    double near_first = dem2di_nearest(first, &count_first, &direction_first);
    double near_second = dem2di_nearest(second, &count_second, &direction_second);
    bool take_first = near_first < near_second;
    memcpy(simplex, take_first ? first : second, sizeof first);
    search->count = take_first ? count_first : count_second;
    *distance = take_first ? near_first : near_second;
    *direction = take_first ? direction_first : direction_second;
    return false;
}

/* Evaluate the support function at u; the search keeps the least value. */
static dem2di_vertex dem2di_evaluate(dem2di_pair *pair, dem2di_search *search, dem2d_vec u) {
    dem2di_vertex v;
    dem2di_minkowski(pair, u, NULL, &v);
    double h = dem2di_dot(v.w, u);
    if (h < search->upper) {
        search->upper = h;
        search->normal = u;
        search->a = v.a;
        search->b = v.b;
    }
    return v;
}

/* Witness points: where the segment of two vertices is nearest to the origin. */
static void dem2di_witness(dem2di_search *search, const dem2di_vertex *v0,
                           const dem2di_vertex *v1) {
    dem2d_vec edge = dem2di_sub(v1->w, v0->w);
    double square = dem2di_dot(edge, edge);
    double t = square > 0 ? -dem2di_dot(v0->w, edge) / square : 0;
    t = dem2di_max(0, dem2di_min(1, t));
    search->a = dem2di_along(v0->a, t, dem2di_sub(v1->a, v0->a));
    search->b = dem2di_along(v0->b, t, dem2di_sub(v1->b, v0->b));
}

static void dem2di_feature_clear(dem2di_search *search) {
    search->feature.own = search->feature.corner[0] = search->feature.corner[1] = -1;
    search->alone = false;
}

/* The state of a resolved pair: the sign of the depth, outside rounding errors. */
static dem2d_contact_state dem2di_state_of(const dem2di_pair *pair, const dem2di_search *search) {
    double roundoff = DEM2DI_ROUNDOFF * pair->size;
    if (search->upper < -roundoff) return DEM2D_SEPARATED;
    return search->upper > roundoff ? DEM2D_PENETRATING : DEM2D_TOUCHING;
}

/* GJK ([P] sec. 3.1, steps 1-7) in the plane. With `detect` it stops at the first separating
   direction; otherwise it continues until distance and separation agree within the tolerance (m).
   Overlap (the origin is in the simplex, or within rounding errors of it) gives PENETRATING with
   lower = 0: EPA then finds the depth. */
static void dem2di_gjk(dem2di_pair *pair, dem2d_vec start, double tolerance, int cap, bool detect,
                       dem2di_search *search) {
    double roundoff = DEM2DI_ROUNDOFF * pair->size, distance;
    dem2d_vec u = start;
    search->iterations = 0;
    dem2di_feature_clear(search);
    search->proof = DEM2D_BY_RADIUS; /* of a gap */
    search->upper = HUGE_VAL;
    search->normal = u;
    search->a = search->b = dem2di_vec(0, 0);
    search->simplex[0] = dem2di_evaluate(pair, search, u);
    search->count = 1;
    if (detect && search->upper < -roundoff) {
        search->lower = -dem2di_length(search->simplex[0].w);
        search->state = DEM2D_SEPARATED;
        return;
    }
    search->simplex[1] = search->simplex[0];
    distance = dem2di_nearest(search->simplex, &search->count, &u);
    search->state = DEM2D_PENETRATING;
    while (distance > roundoff) {
        search->lower = -distance;
        if (search->iterations++ == cap) {
            search->state = DEM2D_UNRESOLVED;
            search->proof = DEM2D_BY_NOTHING;
            return;
        }
        dem2di_vertex v = dem2di_evaluate(pair, search, u);
        double gap = -search->upper;
        if (gap > roundoff && (detect || distance - gap <= tolerance)) {
            if (!detect)
                dem2di_witness(search, &search->simplex[0], &search->simplex[search->count - 1]);
            search->state = DEM2D_SEPARATED;
            return;
        }
        if (dem2di_simplex_add(search, v, &distance, &u)) break;
    }
    search->lower = 0;
}

/* ============================================================================================
   >>epa  Depth of two overlapping shapes: expanding polytope
   uses: config, math, support, gjk
   ============================================================================================ */

/* Room for vertices and edges on the stack; each iteration adds one of each. */
#define DEM2DI_EPA_ITERATIONS 250
#define DEM2DI_EPA_ROOM (DEM2DI_EPA_ITERATIONS + 8)

/* An edge of the polytope: its distance bounds the depth for directions between those of its
   ends. */
typedef struct dem2di_edge {
    int from, to;
    dem2d_vec normal; /* outward */
    double distance;  /* of the origin, negative outside */
} dem2di_edge;

typedef struct dem2di_polytope {
    int vertices, edges;
    bool arcs; /* branch and bound: edges of the shapes eroded by their least rho */
    dem2di_vertex vertex[DEM2DI_EPA_ROOM];
    dem2d_vec direction[DEM2DI_EPA_ROOM]; /* in which the vertex is the support point */
    dem2di_edge edge[DEM2DI_EPA_ROOM];
} dem2di_polytope;

/* Lower bound of the pair's rho over the directions between two, at most half a turn apart. */
static double dem2di_pair_least_rho_between(const dem2di_pair *pair, dem2d_vec from, dem2d_vec to) {
    double a = dem2di_least_rho_between(pair->a, dem2di_turn_back(pair->ra, from),
                                        dem2di_turn_back(pair->ra, to));
    double b = dem2di_least_rho_between(pair->b, dem2di_turn_back(pair->rb, dem2di_negate(from)),
                                        dem2di_turn_back(pair->rb, dem2di_negate(to)));
    return a * pair->scale_a + b * pair->scale_b;
}

/* Is a direction (of any length) inside the arc between two others, at most half a turn apart? */
static bool dem2di_inside(dem2d_vec u, dem2d_vec from, dem2d_vec to) {
    return dem2di_cross(from, u) > 0 && dem2di_cross(u, to) > 0;
}

/* Lower bound of the depth on an arc of directions. With r the least rho there, h - r is the
   support value of a convex body, so it is not below max(p.u, q.u) with its support points p, q at
   both ends. The minima of that are at the ends, across the chord of p and q, and opposite to p and
   q, if these directions are on the arc. */
static bool dem2di_arc_set(const dem2di_pair *pair, dem2di_polytope *polytope, int slot, int from,
                           int to) {
    dem2di_edge *edge = &polytope->edge[slot];
    dem2d_vec u = polytope->direction[from], v = polytope->direction[to];
    double r = dem2di_pair_least_rho_between(pair, u, v);
    dem2d_vec p = dem2di_along(polytope->vertex[from].w, -r, u);
    dem2d_vec q = dem2di_along(polytope->vertex[to].w, -r, v);
    dem2d_vec chord = dem2di_sub(q, p), low[3];
    double least = dem2di_min(dem2di_dot(p, u), dem2di_dot(q, v));
    low[0] = dem2di_vec(chord.y, -chord.x);
    low[1] = dem2di_negate(p);
    low[2] = dem2di_negate(q);
    edge->from = from;
    edge->to = to;
    edge->normal = u;
    for (int i = 0; i < 3; i++) {
        dem2d_vec n;
        if (!dem2di_inside(low[i], u, v) || !dem2di_unit(low[i], &n)) continue;
        double value = i == 2 ? dem2di_dot(q, n) : dem2di_dot(p, n);
        if (!(value < least)) continue;
        least = value;
        /* near an end nothing would be cut off: take the middle */
        double width = 1e-3 * dem2di_cross(u, v);
        bool end = dem2di_cross(u, n) < width || dem2di_cross(n, v) < width;
        if (!end || !dem2di_unit(dem2di_add(u, v), &edge->normal)) edge->normal = n;
    }
    edge->distance = r + least;
    return true;
}

/* Put an edge into a slot. False for one shorter than rounding errors: it has no normal and covers
   no directions. */
static bool dem2di_edge_set(const dem2di_pair *pair, dem2di_polytope *polytope, int slot, int from,
                            int to) {
    if (polytope->arcs) return dem2di_arc_set(pair, polytope, slot, from, to);
    dem2di_edge *edge = &polytope->edge[slot];
    dem2d_vec along = dem2di_sub(polytope->vertex[to].w, polytope->vertex[from].w);
    double length = dem2di_length(along);
    if (!(length > DEM2DI_ROUNDOFF * pair->size)) return false;
    edge->from = from;
    edge->to = to;
    edge->normal = dem2di_vec(along.y / length, -along.x / length);
    edge->distance = dem2di_dot(polytope->vertex[from].w, edge->normal);
    return true;
}

/* Append a vertex counter-clockwise, with the edge from the vertex before. */
static void dem2di_polytope_push(const dem2di_pair *pair, dem2di_polytope *polytope,
                                 dem2di_vertex v, dem2d_vec u) {
    int last = polytope->vertices;
    polytope->vertex[last] = v;
    polytope->direction[last] = u;
    polytope->vertices++;
    if (last == 0) return;
    if (dem2di_edge_set(pair, polytope, polytope->edges, last - 1, last))
        polytope->edges++;
    else
        polytope->vertices--; /* the same point again */
}

static void dem2di_polytope_close(const dem2di_pair *pair, dem2di_polytope *polytope) {
    if (polytope->vertices < 2) return;
    if (dem2di_edge_set(pair, polytope, polytope->edges, polytope->vertices - 1, 0))
        polytope->edges++;
}

/* A polytope around (or touching) the origin from GJK's last simplex: the triangle, or a segment
   with the support points across it, or the support points in four directions. */
static void dem2di_polytope_start(dem2di_pair *pair, dem2di_search *search,
                                  dem2di_polytope *polytope) {
    const dem2di_vertex *s = search->simplex;
    dem2d_vec u = search->normal;
    polytope->vertices = polytope->edges = 0;
    polytope->arcs = false;
    if (search->count == 3) {
        double turn = dem2di_cross(dem2di_sub(s[1].w, s[0].w), dem2di_sub(s[2].w, s[0].w));
        dem2di_polytope_push(pair, polytope, s[0], u);
        dem2di_polytope_push(pair, polytope, turn > 0 ? s[1] : s[2], u);
        dem2di_polytope_push(pair, polytope, turn > 0 ? s[2] : s[1], u);
    } else {
        if (search->count == 2) (void)dem2di_unit(dem2di_perp(dem2di_sub(s[1].w, s[0].w)), &u);
        for (int i = 0; i < 4; i++) {
            bool known = search->count == 2 && i % 2 == 1; /* the ends of the segment */
            dem2di_vertex v = known ? s[i / 2] : dem2di_evaluate(pair, search, u);
            dem2di_polytope_push(pair, polytope, v, u);
            u = dem2di_perp(u);
        }
    }
    dem2di_polytope_close(pair, polytope);
}

static int dem2di_nearest_edge(const dem2di_polytope *polytope) {
    int best = 0;
    for (int i = 1; i < polytope->edges; i++)
        if (polytope->edge[i].distance < polytope->edge[best].distance) best = i;
    return best;
}

/* Expand the nearest edge until its distance and the least support value agree within the tolerance
   (m). The nearest edge bounds the depth from below (the polytope is inside), each support value
   from above. The witness points are those of the last edge, or, with arcs, of the least value. */
static void dem2di_epa(dem2di_pair *pair, dem2di_polytope *polytope, double tolerance, int cap,
                       dem2di_search *search) {
    search->state = DEM2D_UNRESOLVED;
    search->proof = DEM2D_BY_NOTHING;
    search->lower = -pair->size;
    if (polytope->edges == 0) return; /* support points that are not finite or all coincide */
    if (cap > DEM2DI_EPA_ITERATIONS) cap = DEM2DI_EPA_ITERATIONS;
    double roundoff = DEM2DI_ROUNDOFF * pair->size;
    for (int iteration = 0;; iteration++) {
        int nearest = dem2di_nearest_edge(polytope);
        dem2di_edge edge = polytope->edge[nearest];
        search->lower = dem2di_min(search->upper, edge.distance);
        if (polytope->arcs && search->upper - edge.distance <= tolerance &&
            (search->upper < -roundoff || edge.distance >= -roundoff))
            break; /* the sign is certain, too */
        if (iteration == cap) return;
        search->iterations++;
        dem2di_vertex v = dem2di_evaluate(pair, search, edge.normal);
        double h = dem2di_dot(v.w, edge.normal);
        if (!polytope->arcs) {
            search->residual = dem2di_length(v.w) - edge.distance; /* [P] sec. 3.2 */
            if (h - edge.distance <= tolerance) { /* normal and witness points of this edge */
                search->upper = h;
                search->normal = edge.normal;
                dem2di_witness(search, &polytope->vertex[edge.from], &polytope->vertex[edge.to]);
                break;
            }
        }
        int added = polytope->vertices++, last = polytope->edges;
        polytope->vertex[added] = v;
        polytope->direction[added] = edge.normal;
        bool first = dem2di_edge_set(pair, polytope, nearest, edge.from, added);
        bool second = dem2di_edge_set(pair, polytope, first ? last : nearest, added, edge.to);
        if (first && second) polytope->edges++;
        if (first || second) continue;
        polytope->edge[nearest] = polytope->edge[--polytope->edges]; /* within rounding errors */
        if (polytope->edges == 0) break;
    }
    search->state = dem2di_state_of(pair, search);
    search->proof = DEM2D_BY_POLYTOPE;
}

/* ============================================================================================
   >>edges  Two polygons, sharp or rounded, or a polygon and a circle: exact, by edges and corners
   uses: config, math, support, gjk
   ============================================================================================ */

/* The cone of directions about d that can have a support value below h: elsewhere the inscribed
   circles, with the value i_A + i_B - d.u, exclude it. False if they exclude too little. */
static bool dem2di_cone(const dem2di_pair *pair, double h, dem2d_vec end[2]) {
    double inner = pair->a->inscribed * pair->scale_a + pair->b->inscribed * pair->scale_b;
    double c = inner - h;
    if (!(pair->distance > 0) || !(c > -0.5 * pair->distance)) return false;
    c = dem2di_min(1, c / pair->distance);
    double sine = sqrt(1 - c * c);
    dem2d_vec d = dem2di_scale(pair->d, 1 / pair->distance);
    end[0] = dem2di_along(dem2di_scale(d, c), -sine, dem2di_perp(d));
    end[1] = dem2di_along(dem2di_scale(d, c), sine, dem2di_perp(d));
    return dem2di_vec_finite(end[0]) && dem2di_vec_finite(end[1]);
}

/* A start direction this near (sine) to the normal of an edge is moved there: contacts rest on
   edges, and the edge turns with its polygon. */
#define DEM2DI_SNAP 0.01

/* Has a shape a core, a sharp polygon or a point, that is grown by a radius? */
static bool dem2di_has_core(const dem2d_shape *shape) {
    return shape->type == DEM2D_CIRCLE || shape->type == DEM2D_POLYGON;
}

/* The corners of a core; a circle is a core of one corner. */
static inline const dem2d_vec *dem2di_core_corners(const dem2d_shape *shape) {
    static const dem2d_vec centre = {0, 0};
    return shape->type == DEM2D_CIRCLE ? &centre : shape->corners;
}

/* Corners of a core; 0 of shapes that have none. */
static inline int dem2di_core_count(const dem2d_shape *shape) {
    return shape->type == DEM2D_POLYGON ? shape->count : shape->type == DEM2D_CIRCLE;
}

/* The radius by which a core is grown. */
static inline double dem2di_core_radius(const dem2d_shape *shape, double scale) {
    return (shape->type == DEM2D_CIRCLE ? shape->a : shape->rounding) * scale;
}

/* The core of a shape. B is reflected through its centre: A minus B is then the sum of both cores,
   and the corners of both advance counter-clockwise with the direction. */
typedef struct dem2di_core {
    const dem2d_vec *corners, *tangents;
    int count;
    dem2d_rot q;
    double scale, sign; /* both negative for B */
    double radius;      /* by which it is grown */
    double behind;      /* of the first core: see dem2di_cores_set */
} dem2di_core;

static void dem2di_core_set(const dem2d_shape *shape, dem2d_rot q, double scale, double sign,
                            dem2di_core *core) {
    core->corners = dem2di_core_corners(shape);
    core->tangents = shape->tangents;
    core->count = dem2di_core_count(shape);
    core->q.c = q.c;
    core->q.s = q.s;
    core->scale = sign * scale;
    core->sign = sign;
    core->radius = dem2di_core_radius(shape, scale);
    core->behind = 0;
}

/* The two edges of a segment are half a turn apart: after one of them, the sign of a cross product
   can't distinguish an edge parallel to it from its other edge. So if the next tangents of both
   cores are on one line within rounding errors, the edge of the other core comes first (behind):
   that is right if they are opposite, and either order is right if they are not. */
static void dem2di_cores_set(const dem2di_pair *pair, dem2di_core core[2]) {
    dem2di_core_set(pair->a, pair->ra, pair->scale_a, 1, &core[0]);
    dem2di_core_set(pair->b, pair->rb, pair->scale_b, -1, &core[1]);
    core[0].behind = ((core[0].count == 2) - (core[1].count == 2)) * (8 * DBL_EPSILON);
}

/* A walk along the boundary of A minus B minus d, at a corner w: corner k[] of each core at p[],
   and the counter-clockwise tangents t[] of the edges that come next on one side; 0 if a core has
   none. */
typedef struct dem2di_walk {
    int k[2];
    dem2d_vec p[2], t[2], w;
} dem2di_walk;

/* An edge of A minus B passed on a walk: the edge of core `own` after (side 1) or before (-1) its
   corner k[own]. The corners k[] are at p[], the other end of the edge is at `to`. */
typedef struct dem2di_passed_edge {
    int k[2], own, side;
    dem2d_vec p[2], to;
    dem2d_vec tangent;
    double h; /* support value at its normal */
} dem2di_passed_edge;

static inline void dem2di_core_corner(const dem2di_core *core, int k, dem2d_vec *p) {
    dem2d_vec v = dem2di_turn(core->q, core->corners[k]);
    p->x = v.x * core->scale;
    p->y = v.y * core->scale;
}

/* The tangent of the edge beside corner k. */
static inline void dem2di_core_tangent(const dem2di_core *core, int k, int side, dem2d_vec *t) {
    if (core->count == 1) {
        t->x = t->y = 0;
        return;
    }
    dem2d_vec v = core->tangents[side > 0 ? k : dem2di_around(core->count, k, -1)];
    t->x = core->sign * (core->q.c * v.x - core->q.s * v.y);
    t->y = core->sign * (core->q.s * v.x + core->q.c * v.y);
}

static void dem2di_walk_set(const dem2di_pair *pair, const dem2di_core core[2], int ka, int kb,
                            int side, dem2di_walk *walk) {
    walk->k[0] = ka;
    walk->k[1] = kb;
    for (int i = 0; i < 2; i++) {
        dem2di_core_corner(&core[i], walk->k[i], &walk->p[i]);
        dem2di_core_tangent(&core[i], walk->k[i], side, &walk->t[i]);
    }
    walk->w.x = (walk->p[0].x + walk->p[1].x) - pair->d.x;
    walk->w.y = (walk->p[0].y + walk->p[1].y) - pair->d.y;
}

/* Walk along the next edge to its other end. */
static inline void dem2di_walk_on(const dem2di_pair *pair, const dem2di_core core[2], int side,
                                  dem2di_walk *walk, dem2di_passed_edge *edge) {
    /* no short circuits: branches could not be predicted */
    int first = side * dem2di_cross(walk->t[0], walk->t[1]) > core[0].behind;
    int i = 1 - ((first & (core[0].count > 1)) | (core[1].count == 1));
    edge->own = i;
    edge->side = side;
    edge->tangent.x = walk->t[i].x;
    edge->tangent.y = walk->t[i].y;
    edge->h = walk->w.x * edge->tangent.y - walk->w.y * edge->tangent.x;
    for (int j = 0; j < 2; j++) {
        edge->k[j] = walk->k[j];
        edge->p[j].x = walk->p[j].x;
        edge->p[j].y = walk->p[j].y;
    }
    walk->k[i] = dem2di_around(core[i].count, walk->k[i], side);
    dem2di_core_corner(&core[i], walk->k[i], &walk->p[i]);
    dem2di_core_tangent(&core[i], walk->k[i], side, &walk->t[i]);
    edge->to.x = walk->p[i].x;
    edge->to.y = walk->p[i].y;
    walk->w.x = (walk->p[0].x + walk->p[1].x) - pair->d.x;
    walk->w.y = (walk->p[0].y + walk->p[1].y) - pair->d.y;
}

/* The result for the shapes, from an overlap of the cores along a normal, at their points p and
   q. */
static void dem2di_core_report(const dem2di_core core[2], dem2d_vec p, dem2d_vec q,
                               dem2d_vec normal, double overlap, dem2di_search *search) {
    search->normal = normal;
    search->upper = search->lower = overlap + (core[0].radius + core[1].radius);
    search->a = dem2di_along(p, core[0].radius, normal);
    search->b = dem2di_negate(dem2di_along(q, core[1].radius, normal));
}

/* The foot of the origin on an edge, as a fraction of the edge from its first end. */
static double dem2di_edge_foot(const dem2di_pair *pair, const dem2di_passed_edge *edge) {
    dem2d_vec w = dem2di_sub(dem2di_add(edge->p[0], edge->p[1]), pair->d);
    dem2d_vec along = dem2di_sub(edge->to, edge->p[edge->own]);
    return -dem2di_dot(w, along) / dem2di_dot(along, along);
}

/* The result at the foot of the origin on an edge. If an edge of A and one of B are parallel they
   follow each other, and the foot may be on the second one. */
static void dem2di_edge_report(const dem2di_pair *pair, const dem2di_core core[2],
                               const dem2di_passed_edge *edge, dem2di_search *search) {
    dem2di_passed_edge next;
    double t = dem2di_edge_foot(pair, edge);
    if (t < 0 || t > 1) {
        int side = edge->side, k[2] = {edge->k[0], edge->k[1]};
        if (t > 1) k[edge->own] = dem2di_around(core[edge->own].count, k[edge->own], side);
        if (t < 0) side = -side;
        dem2di_walk beyond;
        dem2di_walk_set(pair, core, k[0], k[1], side, &beyond);
        dem2di_walk_on(pair, core, side, &beyond, &next);
        if (fabs(next.h - edge->h) <= DEM2DI_ROUNDOFF * pair->size &&
            dem2di_dot(next.tangent, edge->tangent) > 0) {
            edge = &next;
            t = dem2di_edge_foot(pair, edge);
        }
    }
    t = dem2di_max(0, dem2di_min(1, t));
    dem2d_vec p[2] = {{edge->p[0].x, edge->p[0].y}, {edge->p[1].x, edge->p[1].y}};
    p[edge->own] = dem2di_along(p[edge->own], t, dem2di_sub(edge->to, p[edge->own]));
    /* a foot still outside is on a third edge in line, of the other core */
    double off = dem2di_dot(dem2di_sub(dem2di_add(p[0], p[1]), pair->d), edge->tangent);
    if (fabs(off) > DEM2DI_ROUNDOFF * pair->size)
        p[1 - edge->own] = dem2di_along(p[1 - edge->own], -off, edge->tangent);
    search->feature.own = edge->own;
    for (int i = 0; i < 2; i++) search->feature.corner[i] = edge->k[i];
    if (edge->side < 0)
        search->feature.corner[edge->own] =
            dem2di_around(core[edge->own].count, edge->k[edge->own], -1);
    dem2di_core_report(core, p[0], p[1], dem2di_right(edge->tangent), edge->h, search);
}

/* Separated cores: from the support corner of a separating direction u, walk to the point of A
   minus B nearest to the origin. The distance has one minimum on the side that faces the origin. */
static void dem2di_cores_apart(const dem2di_pair *pair, const dem2di_core core[2], int ka, int kb,
                               dem2d_vec u, dem2di_search *search) {
    double roundoff = DEM2DI_ROUNDOFF * pair->size;
    dem2di_walk walk;
    bool moved = false;
    for (int side = 1; side >= -1 && !moved; side -= 2) {
        dem2di_walk_set(pair, core, ka, kb, side, &walk);
        for (int left = core[0].count + core[1].count; left > 0; left--) { /* once around */
            dem2di_passed_edge edge;
            dem2di_walk next = walk;
            dem2di_walk_on(pair, core, side, &next, &edge);
            /* an edge that faces away from the origin, or leads away from it */
            if (edge.h > roundoff || !(side * dem2di_dot(walk.w, edge.tangent) < 0)) break;
            walk = next;
            moved = true;
            if (side * dem2di_dot(walk.w, edge.tangent) < 0) continue;
            dem2di_edge_report(pair, core, &edge, search);
            return;
        }
    }
    /* two corners; if rounding errors hide the direction, the separating one is kept */
    dem2d_vec away;
    if (dem2di_length(walk.w) > roundoff && dem2di_unit(walk.w, &away)) u = dem2di_negate(away);
    search->feature.own = -1;
    search->feature.corner[0] = walk.k[0];
    search->feature.corner[1] = walk.k[1];
    dem2di_core_report(core, walk.p[0], walk.p[1], u, dem2di_dot(walk.w, u), search);
}

/* Can no direction from the normal n of the last passed edge to v (of a length), the end of the
   cone on this side, have an overlap below `least`? There h is not below the support value of the
   reached corner w, which is not below `least` at both ends. */
static bool dem2di_walk_excludes(dem2d_vec w, dem2d_vec n, int side, dem2d_vec v, double length,
                                 double least) {
    if (side * dem2di_cross(n, v) > 0) return dem2di_dot(w, v) >= least * length;
    return dem2di_dot(n, v) > 0; /* n is past the end */
}

/* The same on both sides of a minimum, for the cone of a right angle to each side of d: it contains
   the cone of dem2di_cone if the depth is below the inscribed radii. Most contacts of edges need no
   more. */
static bool dem2di_corners_exclude(const dem2di_pair *pair, const dem2d_vec w[2],
                                   const dem2d_vec n[2], double least, double depth) {
    double inner = pair->a->inscribed * pair->scale_a + pair->b->inscribed * pair->scale_b;
    dem2d_vec across = dem2di_perp(pair->d);
    return depth <= inner && dem2di_walk_excludes(w[1], n[1], 1, across, pair->distance, least) &&
           dem2di_walk_excludes(w[0], n[0], -1, dem2di_negate(across), pair->distance, least);
}

/* Of the edges before and after corner k, the one whose normal is nearer to v, given by its first
   corner; returns the sine between them. */
static inline double dem2di_edge_near(const dem2di_core *core, int k, dem2d_vec v, int *edge) {
    if (core->count == 1) return HUGE_VAL;
    int before = dem2di_around(core->count, k, -1);
    double ahead = fabs(dem2di_dot(core->tangents[k], v));
    double back = fabs(dem2di_dot(core->tangents[before], v));
    *edge = ahead < back ? k : before;
    return dem2di_min(ahead, back);
}

/* Faces of polygons are edges whose normals are at most about 45 degrees (cosine) off a contact. An
   edge this near (sine) to a contact counts for both sides of it: the contact is on this edge, up
   to the tolerance of EPA. */
#define DEM2DI_FACE_COSINE 0.7071
#define DEM2DI_ALONG 1e-4

/* A corner of one core at an edge of the other, in coordinates along the edge's normal and tangent.
 */
typedef struct dem2di_corner_at_edge {
    double low, high; /* ends of the edge along its tangent, from the corner on */
    double h, radii;  /* overlap of the cores, radii by which they are grown */
    dem2d_vec v;      /* the normal, against the corner, in coordinates of the corner's shape */
    double sine[2];   /* of the angles between the edge and the edges after and before the corner */
} dem2di_corner_at_edge;

/* Is there no second contact point between an edge and the one beside the corner that rests on it?
   That one is given by its angle with the edge and the height `rise` of its far end above the
   corner; the edge goes on for a length beyond the corner. A second point is where, in this order,
   the far end of either edge is less than the radii away from the line of the other:
   dem2di_second_place takes one of these ends, and finds no point if it is apart. Values within
   `unsure` of 0 decide nothing, nor does an edge that may count for both sides. No short circuits:
   branches could not be predicted. */
static DEM2DI_INLINE bool dem2di_side_apart(const dem2di_corner_at_edge *at, double sine,
                                            double cosine, double rise, double length,
                                            double unsure) {
    bool far_apart = rise - at->h - at->radii > unsure;
    bool end_apart = length * sine - at->h * cosine - at->radii > unsure;
    bool no_face = !(cosine > DEM2DI_FACE_COSINE);
    return no_face | ((sine > 2 * DEM2DI_ALONG) & far_apart & end_apart);
}

/* Is it certain that two overlapping polygons, a corner k of one at an edge of the other, have no
   second contact point? The computation of dem2di_pair_second then need not be made: the edge is
   the face of its shape on both sides, and each edge beside the corner that of the other. Both
   computations have errors of a few eps times the size of the pair, 64 eps together at most:
   support values have ROUNDOFF, 16 eps, heights on a face at a slope below 1 twice that. The edges
   of the first shape must not be parallel within rounding errors, so that its face is this edge. */
static DEM2DI_INLINE bool dem2di_corner_alone(const dem2di_pair *pair, const dem2d_shape *own,
                                              int edge, const dem2d_shape *other, double scale,
                                              int k, const dem2di_corner_at_edge *at) {
    const double unsure = 4 * DEM2DI_ROUNDOFF * pair->size;
    if (other->type != DEM2D_POLYGON) return true; /* a circle */
    int before = dem2di_around(other->count, k, -1), after = dem2di_around(other->count, k, 1);
    dem2d_vec here = other->corners[k], v = at->v;
    double rise_after = -dem2di_dot(dem2di_sub(other->corners[after], here), v) * scale;
    double rise_before = -dem2di_dot(dem2di_sub(other->corners[before], here), v) * scale;
    double cosine_after = dem2di_cross(v, other->tangents[k]);
    double cosine_before = dem2di_cross(v, other->tangents[before]);
    dem2d_vec last = own->tangents[dem2di_around(own->count, edge, -1)];
    bool distinct = fabs(dem2di_cross(last, own->tangents[edge])) > 4 * DEM2DI_ROUNDOFF;
    return distinct &
           dem2di_side_apart(at, at->sine[0], cosine_after, rise_after, -at->low, unsure) &
           dem2di_side_apart(at, at->sine[1], cosine_before, rise_before, at->high, unsure);
}

/* An edge of one core and the corner of the other that is farthest along its normal n. They are the
   answer if the origin's foot is on the edge and if the cores are separated, or the ends of the
   edge exclude all other directions within a right angle to each side of d (see
   dem2di_corners_exclude). In coordinates along n and the tangent t only the other core's corner
   has to be rotated. With `check` the corner is checked first, and whether there is no second
   contact point. */
static DEM2DI_INLINE bool dem2di_feature_holds(const dem2di_pair *pair,
                                               const dem2di_feature *feature, bool check,
                                               dem2di_search *search) {
    const bool of_a = feature->own == 0; /* B is reflected: its scale counts as negative */
    const dem2d_shape *own = of_a ? pair->a : pair->b, *other = of_a ? pair->b : pair->a;
    const dem2d_rot q = of_a ? pair->ra : pair->rb, turn = of_a ? pair->rb : pair->ra;
    const double scale = of_a ? pair->scale_a : pair->scale_b, sign = of_a ? 1 : -1;
    const double other_scale = of_a ? pair->scale_b : pair->scale_a;
    const int edge = of_a ? feature->corner[0] : feature->corner[1];
    const int k = of_a ? feature->corner[1] : feature->corner[0];
    const dem2d_vec along = own->tangents[edge], c0 = own->corners[edge];
    const dem2d_vec c1 = own->corners[dem2di_around(own->count, edge, 1)];
    dem2di_corner_at_edge at;
    dem2d_vec t = dem2di_turn(q, along);
    t.x *= sign;
    t.y *= sign;
    dem2d_vec n = dem2di_right(t);
    at.sine[0] = at.sine[1] = 0;
    at.v = dem2di_turn_back(turn, dem2di_scale(n, -sign));
    if (check && other->type == DEM2D_POLYGON) {
        at.sine[0] = -dem2di_dot(other->tangents[k], at.v);
        at.sine[1] = dem2di_dot(other->tangents[dem2di_around(other->count, k, -1)], at.v);
        if (!((at.sine[0] >= 0) & (at.sine[1] >= 0))) return false;
    }
    dem2d_vec p = dem2di_turn(turn, dem2di_core_corners(other)[k]);
    p.x *= -sign * other_scale;
    p.y *= -sign * other_scale;
    double height = dem2di_cross(c0, along) * scale;
    double dn = dem2di_dot(pair->d, n), dt = dem2di_dot(pair->d, t);
    dem2d_vec from = dem2di_sub(pair->d, p); /* on the edge if the depth is 0 */
    double foot = dem2di_dot(from, t);
    at.low = dem2di_dot(c0, along) * scale - foot;
    at.high = dem2di_dot(c1, along) * scale - foot;
    at.h = height - dem2di_dot(from, n);
    double radius_a = dem2di_core_radius(pair->a, pair->scale_a);
    double radius_b = dem2di_core_radius(pair->b, pair->scale_b);
    at.radii = radius_a + radius_b;
    double inner = pair->a->inscribed * pair->scale_a + pair->b->inscribed * pair->scale_b;
    double least = at.h * pair->distance, turned = at.h * dt;
    bool ends = (dn > 0) & (dn * at.high - turned >= least) & (turned - dn * at.low >= least);
    if (!((at.low <= 0) & (at.high >= 0) & ((at.h < 0) | (ends & (at.h + at.radii <= inner)))))
        return false;
    dem2d_vec foot_own = dem2di_along(dem2di_scale(n, height), foot, t);
    dem2d_vec on_a = of_a ? foot_own : p, on_b = of_a ? p : foot_own;
    search->feature = *feature;
    search->normal.x = n.x;
    search->normal.y = n.y;
    search->upper = search->lower = at.h + at.radii;
    search->a = dem2di_along(on_a, radius_a, n);
    search->b = dem2di_negate(dem2di_along(on_b, radius_b, n));
    search->alone = check && dem2di_corner_alone(pair, own, edge, other, other_scale, k, &at);
    return true;
}

/* Try a start direction near an edge's normal, which is frequent. The corners k[] are the farthest
   along the start direction, which is v[] in the coordinates of each core. */
static bool dem2di_edge_warm(const dem2di_pair *pair, const dem2di_core core[2], const int k[2],
                             const dem2d_vec v[2], dem2di_search *search) {
    dem2di_feature near;
    int edges[2] = {0, 0};
    double near_a = dem2di_edge_near(&core[0], k[0], v[0], &edges[0]);
    double near_b = dem2di_edge_near(&core[1], k[1], v[1], &edges[1]);
    if (!(dem2di_min(near_a, near_b) <= DEM2DI_SNAP)) return false;
    int i = near_b < near_a;
    near.own = i;
    near.corner[i] = edges[i];
    near.corner[1 - i] = k[1 - i];
    /* a sine may be that of nearly half a turn */
    return dem2di_cross(v[i], core[i].tangents[edges[i]]) > 0 &&
           dem2di_feature_holds(pair, &near, false, search);
}

/* Try the feature of the last step, which may be that of any pair; false if it is not known to be
   the answer. */
static DEM2DI_INLINE bool dem2di_edge_last(dem2di_pair *pair, const dem2di_feature *last,
                                           dem2di_search *search) {
    if (last == NULL || (unsigned)last->own > 1) return false;
    int count_a = dem2di_core_count(pair->a), count_b = dem2di_core_count(pair->b);
    if (!((unsigned)last->corner[0] < (unsigned)count_a &&
          (unsigned)last->corner[1] < (unsigned)count_b &&
          (last->own == 0 ? count_a : count_b) > 1 &&
          dem2di_feature_holds(pair, last, true, search)))
        return false;
    pair->calls++;
    search->proof = DEM2D_BY_FORM;
    return true;
}

/* Edges passed to each side before branch and bound is cheaper, measured: 24 take as long as the 15
   support evaluations it needs for polygons of 64 corners. */
#define DEM2DI_MANY_EDGES 24

/* Overlapping cores: the least support value is at an edge's normal. Walk to both sides of the
   start until the reached corners exclude the rest of the cone. With `beside` the better of the
   next two edges is known to be the one. False if there are too many edges, as for large polygons
   that are not round. */
static inline bool dem2di_cores_overlap(const dem2di_pair *pair, const dem2di_core core[2],
                                        dem2di_walk walk[2], bool beside, dem2di_search *search) {
    dem2di_passed_edge edge[2]; /* the best, and the last passed */
    dem2d_vec end[2], n[2];
    int best = 0;
    bool cone = false;
    edge[0].h = HUGE_VAL;
    int all = core[0].count + core[1].count;
    for (int i = 0; i <= DEM2DI_MANY_EDGES; i++) {
        bool open = false;
        for (int side = 0; side < 2; side++) {
            dem2di_walk *here = &walk[side];
            int turn = side > 0 ? 1 : -1;
            if (cone && dem2di_walk_excludes(here->w, n[side], turn, end[side], 1, edge[best].h))
                continue;
            open = true;
            dem2di_passed_edge *passed = &edge[1 - best];
            dem2di_walk_on(pair, core, turn, here, passed);
            n[side].x = passed->tangent.y;
            n[side].y = -passed->tangent.x;
            best = passed->h < edge[best].h ? 1 - best : best;
            if (!(passed->h < 0)) continue;
            dem2di_cores_apart(pair, core, here->k[0], here->k[1], n[side], search);
            return true;
        }
        double depth = edge[best].h + (core[0].radius + core[1].radius);
        dem2d_vec w[2] = {{walk[0].w.x, walk[0].w.y}, {walk[1].w.x, walk[1].w.y}};
        if (!open || i == all || beside ||
            (i == 0 && dem2di_corners_exclude(pair, w, n, edge[best].h, depth))) {
            if (!(edge[best].h < HUGE_VAL)) return false; /* all values overflow */
            dem2di_edge_report(pair, core, &edge[best], search);
            return true;
        }
        search->iterations++;
        if (i == 0) cone = dem2di_cone(pair, depth, end);
    }
    return false;
}

/* Least overlap or greatest gap of two shapes with cores: try the start u, then walk along the
   boundary of A minus B. See dem2di_cores_overlap for `beside` and the result. */
static bool dem2di_edges_solve(dem2di_pair *pair, dem2d_vec u, bool beside, dem2di_search *search) {
    dem2di_core core[2];
    dem2di_walk walk[2];
    dem2di_cores_set(pair, core);
    pair->calls++;
    search->proof = DEM2D_BY_FORM;
    /* from a start behind, both sides would seem to be past the cone */
    if (!(dem2di_dot(u, pair->d) > 0)) u = dem2di_centres(pair);
    int k[2] = {0, 0};
    dem2d_vec v[2];
    for (int i = 0; i < 2; i++) {
        const dem2d_shape *shape = i == 0 ? pair->a : pair->b;
        v[i] = dem2di_turn_back(core[i].q, dem2di_scale(u, core[i].sign));
        if (core[i].count > 1) k[i] = dem2di_polygon_corner(shape, v[i]);
    }
    if (!beside && dem2di_edge_warm(pair, core, k, v, search)) return true;
    for (int i = 0; i < 2; i++) dem2di_walk_set(pair, core, k[0], k[1], i > 0 ? 1 : -1, &walk[i]);
    if (dem2di_dot(walk[0].w, u) < 0) {
        dem2di_cores_apart(pair, core, k[0], k[1], u, search);
        return true;
    }
    return dem2di_cores_overlap(pair, core, walk, beside, search);
}

/* ============================================================================================
   >>minimum  Least support value of A minus B: Newton's steps, a proof, branch and bound
   uses: config, math, support, gjk, epa, edges
   ============================================================================================ */

/* An evaluation of h(u) = s(u).u and its slope s(u).perp(u). On the normal of an edge there are two
   support points: v[0] from the clockwise side, v[1] from the counter-clockwise side; elsewhere
   only v[0] is used. */
typedef struct dem2di_eval {
    dem2d_vec u;
    dem2di_vertex v[2];
    bool edge;
    double h, slope[2]; /* slopes on both sides */
    double rho[2];      /* of A and of B, without the edge */
    int part[2][2];     /* of A and of B, if the pair has edges, for v[0] and v[1] */
    bool no_step;       /* stationary, but Newton's last step is not safe there */
} dem2di_eval;

static inline void dem2di_eval_smooth(dem2di_pair *pair, dem2d_vec u, dem2di_eval *eval) {
    dem2di_vertex *v = &eval->v[0];
    dem2di_minkowski(pair, u, eval->rho, v);
    eval->u.x = u.x;
    eval->u.y = u.y;
    eval->edge = false;
    eval->h = v->w.x * u.x + v->w.y * u.y;
    eval->slope[0] = eval->slope[1] = u.x * v->w.y - u.y * v->w.x;
}

/* One shape of a pair that has edges: polygons, or polybeziers with straight arcs. Newton's steps
   would never hit the normals of edges exactly. */
typedef struct dem2di_member {
    const dem2d_shape *shape;
    dem2d_rot q;
    double scale;
    int own; /* 0 for A, 1 for B */
} dem2di_member;

static dem2di_member dem2di_member_of(const dem2di_pair *pair, int own) {
    dem2di_member m;
    m.own = own;
    m.shape = own == 0 ? pair->a : pair->b;
    m.q = own == 0 ? pair->ra : pair->rb;
    m.scale = own == 0 ? pair->scale_a : pair->scale_b;
    return m;
}

/* A direction of the pair in the coordinates of a member. */
static dem2d_vec dem2di_member_direction(const dem2di_member *m, dem2d_vec u) {
    return dem2di_turn_back(m->q, m->own == 0 ? u : dem2di_negate(u));
}

static dem2d_vec dem2di_member_normal(const dem2di_member *m, int edge) {
    dem2d_vec u = dem2di_turn(m->q, dem2di_right(m->shape->tangents[edge]));
    return m->own == 0 ? u : dem2di_negate(u);
}

/* Support points s[] of one member in u: both ends of an edge, or (edge -1) the point of a part. */
static void dem2di_member_eval(const dem2di_member *m, dem2d_vec u, int part, int edge,
                               dem2di_eval *eval, dem2d_vec s[2]) {
    const dem2d_shape *shape = m->shape;
    double rho = shape->rounding;
    dem2d_vec v = dem2di_member_direction(m, u);
    for (int i = 0; i < 2; i++) {
        eval->part[m->own][i] = part;
        if (edge >= 0) {
            s[i] = dem2di_edge_end(shape, edge, i == 1);
            eval->part[m->own][i] = dem2di_edge_part(shape, edge, 2 * i - 1);
        } else if (i == 1) {
            s[1] = s[0];
            continue;
        } else if (shape->type == DEM2D_POLYGON) {
            s[0] = shape->corners[part];
        } else if (shape->type == DEM2D_BEZIER) {
            s[0] = dem2di_arc_support(&shape->arcs[part], v, &rho);
        } else {
            s[0] = dem2di_support(shape, v, &rho);
        }
        if (shape->type == DEM2D_POLYGON) s[i] = dem2di_along(s[i], rho, v);
        s[i] = dem2di_scale(dem2di_turn(m->q, s[i]), m->scale);
    }
    eval->rho[m->own] = rho * m->scale;
}

/* Evaluation at u, with the edge (-1: none) or the part of each member. */
static void dem2di_eval_parts(dem2di_pair *pair, const dem2di_member member[2], dem2d_vec u,
                              const int part[2], const int edge[2], dem2di_eval *eval) {
    dem2d_vec a[2], b[2];
    eval->u = u;
    eval->edge = edge[0] >= 0 || edge[1] >= 0;
    dem2di_member_eval(&member[0], u, part[0], edge[0], eval, a);
    dem2di_member_eval(&member[1], u, part[1], edge[1], eval, b);
    for (int i = 0; i < 2; i++) {
        if (i == 0 || eval->edge) dem2di_vertex_set(pair, a[i], b[i], &eval->v[i]);
        eval->slope[i] = dem2di_cross(u, eval->v[eval->edge ? i : 0].w);
    }
    eval->h = dem2di_dot(eval->v[0].w, u);
    pair->calls++;
}

/* The part of a member that has its support point in u; 0 if the member has no parts. */
static inline int dem2di_member_part(const dem2di_member *m, dem2d_vec u) {
    if (!dem2di_has_parts(m->shape)) return 0;
    return dem2di_part_find(m->shape, dem2di_member_direction(m, u));
}

/* The edge beside a part whose normal is nearest to u, with a sine below *sine, which gets the sine
   between them; -1 if there is none that faces u. */
static int dem2di_member_near(const dem2di_member *m, dem2d_vec u, int part, double *sine) {
    int nearest = -1;
    if (!m->shape->flat) return -1;
    dem2d_vec v = dem2di_member_direction(m, u);
    for (int side = 1; side >= -1; side -= 2) {
        int edge = dem2di_edge_beside(m->shape, part, side);
        dem2d_vec along = m->shape->tangents[edge];
        double off = fabs(dem2di_dot(along, v));
        if (!(off < *sine) || !(dem2di_cross(v, along) > 0)) continue;
        *sine = off;
        nearest = edge;
    }
    return nearest;
}

/* Edges are parallel if the sine between their normals is below this. */
#define DEM2DI_PARALLEL (8 * DBL_EPSILON)

/* Evaluation at the normal of an edge of one member, with the other's edge if that is parallel. */
static void dem2di_eval_edge(dem2di_pair *pair, const dem2di_member member[2], int own, int found,
                             dem2di_eval *eval) {
    int part[2] = {0, 0}, edge[2] = {-1, -1}, other = 1 - own;
    double parallel = DEM2DI_PARALLEL;
    dem2d_vec u = dem2di_member_normal(&member[own], found);
    edge[own] = found;
    part[other] = dem2di_member_part(&member[other], u);
    edge[other] = dem2di_member_near(&member[other], u, part[other], &parallel);
    dem2di_eval_parts(pair, member, u, part, edge, eval);
}

/* The first evaluation: at u, or at the normal of an edge nearby. */
static void dem2di_eval_first(dem2di_pair *pair, const dem2di_member member[2], dem2d_vec u,
                              dem2di_eval *eval) {
    static const int none[2] = {-1, -1};
    int part[2], own = -1, found = -1;
    double sine = DEM2DI_SNAP;
    for (int i = 0; i < 2; i++) {
        part[i] = dem2di_member_part(&member[i], u);
        int edge = dem2di_member_near(&member[i], u, part[i], &sine);
        if (edge >= 0) own = i, found = edge;
    }
    if (found >= 0)
        dem2di_eval_edge(pair, member, own, found, eval);
    else
        dem2di_eval_parts(pair, member, u, part, none, eval);
}

/* The last edge of a member between two of its parts, turning to a side; -1 if there is none. */
static inline int dem2di_member_passed(const dem2di_member *m, int from, int to, int side) {
    if (!m->shape->flat || from == to) return -1;
    int edge = dem2di_edge_beside(m->shape, to, -side), n = m->shape->parts;
    if (m->shape->type == DEM2D_POLYGON) return edge;
    /* is it between the two parts? */
    int back = side * (to - edge), all = side * (to - from);
    return back + (back < 0 ? n : 0) < all + (all < 0 ? n : 0) ? edge : -1;
}

/* The last edge of both members between the last evaluation and u, whose parts are part[]; -1 if
   there is none. */
static int dem2di_edge_passed(const dem2di_member member[2], dem2d_vec u, const int part[2],
                              const dem2di_eval *eval, int *own) {
    int side = dem2di_cross(eval->u, u) > 0 ? 1 : -1, found = -1;
    dem2d_vec normal = eval->u;
    for (int i = 0; i < 2; i++) {
        int edge = dem2di_member_passed(&member[i], eval->part[i][0], part[i], side);
        if (edge < 0) continue;
        dem2d_vec n = dem2di_member_normal(&member[i], edge);
        if (found >= 0 && side * dem2di_cross(normal, n) <= 0) continue;
        normal = n;
        found = edge;
        *own = i;
    }
    return found;
}

/* The next evaluation, towards u: at u, or at the normal of the last edge before it. */
static void dem2di_eval_towards(dem2di_pair *pair, const dem2di_member member[2], dem2d_vec u,
                                dem2di_eval *eval) {
    static const int none[2] = {-1, -1};
    int part[2], own = 0;
    for (int i = 0; i < 2; i++) part[i] = dem2di_member_part(&member[i], u);
    int found = dem2di_edge_passed(member, u, part, eval, &own);
    if (found >= 0)
        dem2di_eval_edge(pair, member, own, found, eval);
    else
        dem2di_eval_parts(pair, member, u, part, none, eval);
}

/* Reduce an evaluation at an edge to the edge's end on the side of the minimum. */
static void dem2di_leave_edge(const dem2di_pair *pair, int side, dem2di_eval *eval) {
    eval->v[0] = eval->v[side];
    eval->slope[0] = eval->slope[1] = eval->slope[side];
    eval->edge = false;
    for (int i = 0; i < 2; i++) {
        const dem2d_shape *shape = i == 0 ? pair->a : pair->b;
        bool own_edge = eval->part[i][0] != eval->part[i][1]; /* the edge is this shape's */
        eval->part[i][0] = eval->part[i][1] = eval->part[i][side];
        if (!own_edge || shape->type != DEM2D_BEZIER) continue;
        double scale = i == 0 ? pair->scale_a : pair->scale_b;
        eval->rho[i] = scale * dem2di_arc_rho(&shape->arcs[eval->part[i][0]], side == 0 ? 1 : 0);
    }
}

/* The directions between which the minimum is, and the support points there if evaluated. */
typedef struct dem2di_bracket {
    dem2d_vec end[2];
    dem2di_vertex at[2];
    bool known, evaluated[2], chord;
    double turned[2]; /* tangents of the last two Newton steps */
} dem2di_bracket;

/* Make the last evaluation an end of the bracket; false if it is outside of the bracket. */
static bool dem2di_bracket_cut(const dem2di_pair *pair, const dem2di_eval *eval,
                               dem2di_bracket *bracket) {
    dem2d_vec u = eval->u;
    if (!bracket->known && !dem2di_cone(pair, eval->h, bracket->end)) {
        bracket->end[0] = dem2di_right(u);
        bracket->end[1] = dem2di_perp(u);
    }
    bracket->known = true;
    dem2d_vec middle = dem2di_sub(dem2di_perp(bracket->end[0]), dem2di_perp(bracket->end[1]));
    bool behind = dem2di_dot(u, middle) < 0 && dem2di_dot(bracket->end[0], bracket->end[1]) > 0;
    if (behind || dem2di_cross(bracket->end[0], u) < 0 || dem2di_cross(u, bracket->end[1]) < 0)
        return false;
    int side = eval->slope[0] < 0 ? 0 : 1;
    bracket->end[side] = u;
    bracket->at[side] = eval->v[0];
    bracket->evaluated[side] = true;
    return true;
}

static bool dem2di_bracket_holds(const dem2di_bracket *bracket, dem2d_vec u) {
    return dem2di_inside(u, bracket->end[0], bracket->end[1]);
}

/* The next direction if Newton's step leaves the bracket or is slow: the normal of the chord of
   both ends (not if slow), which finds edges, or the middle. False if there is no direction between
   the ends. */
static bool dem2di_bracket_next(dem2di_bracket *bracket, bool slow, dem2d_vec *u) {
    const dem2d_vec *end = bracket->end;
    bracket->chord = !slow && bracket->evaluated[0] && bracket->evaluated[1] &&
                     dem2di_unit(dem2di_right(dem2di_sub(bracket->at[1].w, bracket->at[0].w)), u) &&
                     dem2di_bracket_holds(bracket, *u);
    if (bracket->chord) return true;
    /* wider than a right angle: add the inward perpendiculars, which do not cancel there */
    dem2d_vec middle = dem2di_add(end[0], end[1]);
    if (dem2di_dot(end[0], end[1]) < 0)
        middle = dem2di_sub(dem2di_perp(end[0]), dem2di_perp(end[1]));
    /* narrow, but one end was never evaluated: the minimum is outside */
    bool narrow = dem2di_dot(end[0], end[1]) > 0 && dem2di_cross(end[0], end[1]) < 1e-6;
    if (narrow && !(bracket->evaluated[0] && bracket->evaluated[1])) return false;
    return dem2di_unit(middle, u) && dem2di_bracket_holds(bracket, *u);
}

/* Does h curve upward, so that Newton's step can find a minimum? Not if the radius is so large that
   its circle is straight within rounding errors over the size of the pair: that is an edge. */
static bool dem2di_curves_up(const dem2di_pair *pair, double bend) {
    return bend > 0 && bend * DEM2DI_ROUNDOFF < pair->size;
}

/* Is h stationary at the last evaluation? At an edge: if the slope changes sign there. At the
   normal of the bracket's chord: if the chord is an edge within rounding errors. Elsewhere: if
   Newton's step is below `angle`, and lowers h by less than half the tolerance. */
static inline bool dem2di_stationary(const dem2di_pair *pair, const dem2di_bracket *bracket,
                                     double angle, dem2di_eval *eval) {
    if (eval->edge) {
        if (eval->slope[0] <= 0 && eval->slope[1] >= 0) return true;
        dem2di_leave_edge(pair, eval->slope[1] < 0, eval);
    }
    double bend = eval->rho[0] + eval->rho[1] - eval->h, slope = eval->slope[0];
    if (dem2di_curves_up(pair, bend) && fabs(slope) <= angle * bend &&
        slope * slope <= angle * angle * bend * pair->size)
        return true;
    double roundoff = DEM2DI_ROUNDOFF * pair->size;
    if (!bracket->chord || eval->h - dem2di_dot(bracket->at[0].w, eval->u) > roundoff ||
        eval->h - dem2di_dot(bracket->at[1].w, eval->u) > roundoff)
        return false;
    eval->edge = true;
    for (int i = 0; i < 2; i++) {
        eval->v[i] = bracket->at[i];
        eval->slope[i] = dem2di_cross(eval->u, eval->v[i].w);
    }
    return eval->slope[0] <= 0 && eval->slope[1] >= 0;
}

/* Newton's step without angles: u <- (rho u - s)/|rho u - s|, the direction to the centre of the
   osculating circle, which is u + e t with e = -slope/bend, normalised. For small e the root is
   replaced by its series, whose next term is below 5/16 e^6 = 3e-19. */
static inline dem2d_vec dem2di_newton(const dem2di_eval *eval, double bend) {
    double e = -eval->slope[0] / bend, square = e * e, f;
    f = square < 1e-6 ? 1 - square * (0.5 - 0.375 * square) : 1 / sqrt(1 + square);
    double ux = eval->u.x, uy = eval->u.y;
    return dem2di_vec((ux - e * uy) * f, (uy + e * ux) * f);
}

/* May a shape have edges that the search does not know? Custom shapes may. */
static bool dem2di_edges_unknown(const dem2d_shape *shape) {
    return shape->type == DEM2D_CUSTOM;
}

/* A stationary direction without Newton's last step has to be closer to the minimum: by a
   thousandth of the angle, and where shapes are nearly straight as for a circle of their size. */
static inline bool dem2di_stationary_close(const dem2di_pair *pair, double angle, double bend,
                                           const dem2di_eval *eval) {
    return fabs(eval->slope[0]) <= 1e-3 * angle * dem2di_min(bend, pair->size);
}

/* May Newton's last step raise h by more than the tolerance? By rho e^2/2 at most, with the
   greatest rho. */
static inline bool dem2di_step_rises(const dem2di_pair *pair, double angle, double bend,
                                     const dem2di_eval *eval) {
    double most = pair->a->rho_max * pair->scale_a + pair->b->rho_max * pair->scale_b;
    double step = eval->slope[0] / (angle * bend);
    return !(step * step * most <= 2 * pair->size);
}

/* Is a stationary direction close enough to the minimum, with or without (no_step) Newton's last
   step, for a pair with edges? The step must not pass an edge. It is left out if it passes the end
   of an arc, where rho may change, or if h may rise. An edge outside the bracket is excluded. */
static bool dem2di_step_known(const dem2di_pair *pair, const dem2di_member member[2],
                              const dem2di_bracket *bracket, double angle, double bend,
                              dem2di_eval *eval) {
    int part[2], own = 0;
    dem2d_vec u = dem2di_newton(eval, bend);
    eval->no_step |= dem2di_step_rises(pair, angle, bend, eval);
    for (int i = 0; i < 2; i++) {
        part[i] = dem2di_member_part(&member[i], u);
        eval->no_step |= part[i] != eval->part[i][0];
    }
    if (!eval->no_step) return true;
    int edge = dem2di_edge_passed(member, u, part, eval, &own);
    if (edge >= 0) {
        bool seen = bracket->known &&
                    !dem2di_bracket_holds(bracket, dem2di_member_normal(&member[own], edge));
        if (!seen || member[own].shape->type == DEM2D_POLYGON) return false;
    }
    return dem2di_stationary_close(pair, angle, bend, eval);
}

/* The same for a pair without edges. If the witness points move by s past the end of an arc, they
   leave the outline by at most s^2/(2 rho): that is allowed below the default tolerance. */
static inline bool dem2di_step_smooth(const dem2di_pair *pair, double angle, double bend,
                                      dem2di_eval *eval) {
    double r = dem2di_min(pair->a->rho_min * pair->scale_a, pair->b->rho_min * pair->scale_b);
    double slope = eval->slope[0];
    bool rises = dem2di_step_rises(pair, angle, bend, eval);
    if (!rises && slope * slope <= 1e-10 * r * pair->size) return true;
    dem2d_vec u = dem2di_newton(eval, bend);
    eval->no_step |= rises;
    for (int i = 0; i < 2; i++) {
        dem2di_member m = dem2di_member_of(pair, i);
        eval->no_step |= dem2di_member_part(&m, u) != dem2di_member_part(&m, eval->u);
    }
    return !eval->no_step || dem2di_stationary_close(pair, angle, bend, eval);
}

/* The next direction of a descent after step i: Newton's step, or a direction inside the bracket.
   False if there is none. */
static inline bool dem2di_descend_next(const dem2di_pair *pair, const dem2di_eval *eval,
                                       double bend, int i, dem2di_bracket *bracket, dem2d_vec *u) {
    double slope = fabs(eval->slope[0]);
    bool bends = dem2di_curves_up(pair, bend);
    /* small steps need no bracket, unless there are many */
    bool near = bends && slope < 0.2 * bend && i < 4;
    bool outside = (bracket->known || !near) && !dem2di_bracket_cut(pair, eval, bracket);
    /* where rho has no bound Newton's steps may oscillate: each two have to halve the step */
    double turn = bends ? slope / bend : HUGE_VAL;
    bool slow = bracket->known && bracket->evaluated[0] && bracket->evaluated[1] &&
                turn > 0.5 * bracket->turned[0];
    bool newton = bends && !outside && !slow;
    bracket->turned[0] = bracket->turned[1];
    bracket->turned[1] = turn;
    bracket->chord = false;
    if (newton) {
        *u = dem2di_newton(eval, bend);
        if (!bracket->known || dem2di_bracket_holds(bracket, *u)) return true;
    }
    return dem2di_bracket_next(bracket, slow, u);
}

/* Descend from a direction to a local minimum of h by Newton's steps inside a bracket. With
   `detect` it stops at the first separating direction. The caller may have evaluated u already, of
   a pair without edges. False if `cap` evaluations do not suffice. */
static bool dem2di_descend(dem2di_pair *pair, dem2d_vec u, bool evaluated, double angle, int cap,
                           bool detect, dem2di_eval *eval, dem2di_search *search) {
    dem2di_bracket bracket;
    bool edges = pair->a->flat || pair->b->flat;
    dem2di_member member[2];
    bracket.known = bracket.evaluated[0] = bracket.evaluated[1] = bracket.chord = false;
    bracket.turned[0] = bracket.turned[1] = HUGE_VAL;
    if (edges) {
        for (int i = 0; i < 2; i++) member[i] = dem2di_member_of(pair, i);
        dem2di_eval_first(pair, member, u, eval);
    } else if (!evaluated) {
        dem2di_eval_smooth(pair, u, eval);
    }
    for (int i = 0; i < cap; i++) {
        search->iterations++;
        if (eval->h < search->upper) {
            search->upper = eval->h;
            search->normal.x = eval->u.x;
            search->normal.y = eval->u.y;
        }
        if (detect && eval->h < -DEM2DI_ROUNDOFF * pair->size) return true;
        bool stationary = dem2di_stationary(pair, &bracket, angle, eval);
        double bend = eval->rho[0] + eval->rho[1] - eval->h;
        if (stationary) {
            eval->no_step = dem2di_edges_unknown(pair->a) || dem2di_edges_unknown(pair->b);
            if (eval->edge) return true;
            if (edges ? dem2di_step_known(pair, member, &bracket, angle, bend, eval)
                      : dem2di_step_smooth(pair, angle, bend, eval))
                return true;
        }
        if (!dem2di_descend_next(pair, eval, bend, i, &bracket, &u)) return false;
        if (edges)
            dem2di_eval_towards(pair, member, u, eval);
        else
            dem2di_eval_smooth(pair, u, eval);
        /* the evaluation was at an edge before the chord's normal */
        if (eval->u.x != u.x || eval->u.y != u.y) bracket.chord = false;
    }
    return false;
}

/* The result of a descent at a stationary direction: the foot of the origin on an edge; else
   Newton's last step on the osculating circle, which leaves an error of its angle squared, unless
   no_step. */
static void dem2di_descend_finish(const dem2di_eval *eval, dem2di_search *search) {
    const dem2di_vertex *v = eval->v;
    double ux = eval->u.x, uy = eval->u.y, slope = eval->slope[0];
    search->normal.x = ux;
    search->normal.y = uy;
    search->upper = eval->h;
    if (eval->edge) {
        double t = slope < 0 ? slope / (slope - eval->slope[1]) : 0;
        search->a = dem2di_along(v[0].a, t, dem2di_sub(v[1].a, v[0].a));
        search->b = dem2di_along(v[0].b, t, dem2di_sub(v[1].b, v[0].b));
        return;
    }
    /* e is the tangent of the angle; for small e the sine is e, and 1 - cosine and the decrease of
       h, bend e^2/2, have errors of e^4 */
    double e = -slope / (eval->rho[0] + eval->rho[1] - eval->h), fall = e * e / 2, half = 0.5;
    if (eval->no_step) e = fall = 0;
    double tangent = e;
    if (fall > 1e-8) { /* only with a tolerance above 1e-6 */
        double root = sqrt(1 + e * e);
        half = 1 / (1 + root);
        fall = e * e * half / root;
        e /= root;
    }
    double dx = -e * uy - fall * ux, dy = e * ux - fall * uy;
    double nx = ux + dx, ny = uy + dy;
    double f = 1.5 - (nx * nx + ny * ny) / 2; /* normalises: steps and starts change the length */
    search->normal.x = nx * f;
    search->normal.y = ny * f;
    search->upper = eval->h + slope * tangent * half;
    search->a.x = v->a.x + eval->rho[0] * dx;
    search->a.y = v->a.y + eval->rho[0] * dy;
    search->b.x = v->b.x - eval->rho[1] * dx;
    search->b.y = v->b.y - eval->rho[1] * dy;
}

/* Lower bounds of the pair's rho over one sector's width from u: [0] clockwise, [1]
   counter-clockwise. */
static inline void dem2di_pair_least_rho(const dem2di_pair *pair, dem2d_vec u, double rho[2]) {
    double a[2], b[2];
    dem2di_least_rho(pair->a, dem2di_turn_back(pair->ra, u), a);
    dem2di_least_rho(pair->b, dem2di_turn_back(pair->rb, dem2di_negate(u)), b);
    for (int i = 0; i < 2; i++) rho[i] = a[i] * pair->scale_a + b[i] * pair->scale_b;
}

/* Steps below turn by 2 atan(1/64), which is less than any sector of least_rho. */
#define DEM2DI_MARCH_COS (4095.0 / 4097)
#define DEM2DI_MARCH_SIN (128.0 / 4097)

/* Is h nowhere below its stationary value (less the tolerance) from there to v (of a length), the
   end of the cone on one side (0 clockwise, 1 counter-clockwise)? Where rho is at least r, h is at
   least the support value of a circle of radius r with the same value and slope; this is repeated
   from sector to sector, and r is given for the first one. As soon as the support point of these
   circles has no lower value at v, all directions up to v are excluded. */
static bool dem2di_side_excludes(const dem2di_pair *pair, const dem2di_eval *eval, int side,
                                 double r, dem2d_vec v, double length, double tolerance) {
    int turn = side > 0 ? 1 : -1;
    double h = eval->h, slope = turn * eval->slope[side], least = (h - tolerance) * length;
    double along = dem2di_dot(eval->u, v), ahead = turn * dem2di_cross(eval->u, v), rho[2];
    const double c = DEM2DI_MARCH_COS, s = DEM2DI_MARCH_SIN;
    dem2d_vec u = eval->u;
    dem2d_rot step = dem2di_rot(dem2di_vec(c, turn * s));
    /* the remaining slope lowers h by slope^2/(2 (r - h)) */
    if (!(eval->edge ? slope >= 0 : slope * slope <= 2 * tolerance * (r - h))) return false;
    for (int i = 0; i < 20; i++) { /* 20 steps are 36 degrees: a support point farther is rare */
        double next = r + (h - r) * c + slope * s, rest = ahead * c - along * s;
        slope = (r - h) * s + slope * c;
        along = along * c + ahead * s;
        h = next;
        ahead = rest;
        if (!(slope >= 0)) return false;
        if (!(ahead > 0)) return along > 0;
        if (h * along + slope * ahead >= least && h > 0) return true;
        u = dem2di_turn(step, u);
        dem2di_pair_least_rho(pair, u, rho);
        r = rho[side];
    }
    return false;
}

/* How far the ends of an edge are below its support value. A chord of a curved outline counts as an
   edge if that is within rounding errors, and the minimum may be lower by as much. */
static inline double dem2di_face_gap(const dem2di_eval *eval) {
    if (!eval->edge) return 0;
    double first = dem2di_dot(eval->v[0].w, eval->u), last = dem2di_dot(eval->v[1].w, eval->u);
    return dem2di_max(0, eval->h - dem2di_min(first, last));
}

/* Is a stationary value the least of all? With r <= rho everywhere, r - |s - r u| <= depth: A minus
   B eroded by r is convex, and its distance from the origin bounds the depth. Else the least radii
   beside the minimum have to exclude the cone: that of a right angle to each side of d, which needs
   no root and contains the cone of dem2di_cone for depths below the inscribed radii, or that
   one. */
static bool dem2di_certify(const dem2di_pair *pair, const dem2di_eval *eval, double tolerance,
                           dem2di_search *search) {
    double r = pair->a->rho_min * pair->scale_a + pair->b->rho_min * pair->scale_b;
    double h = eval->h, square = eval->edge ? 0 : eval->slope[0] * eval->slope[0];
    double inner = pair->a->inscribed * pair->scale_a + pair->b->inscribed * pair->scale_b;
    double rho[2], allowed = eval->edge ? 0 : tolerance;
    dem2d_vec end[2];
    if (r > h && square <= 2 * tolerance * (r - h)) {
        search->lower = search->upper - dem2di_face_gap(eval) - square / (2 * (r - h));
        search->proof = DEM2D_BY_RADIUS;
        return true;
    }
    dem2di_pair_least_rho(pair, eval->u, rho);
    end[1] = dem2di_perp(pair->d);
    end[0] = dem2di_negate(end[1]);
    if (!(h <= inner &&
          dem2di_side_excludes(pair, eval, 0, rho[0], end[0], pair->distance, allowed) &&
          dem2di_side_excludes(pair, eval, 1, rho[1], end[1], pair->distance, allowed)) &&
        !(dem2di_cone(pair, h, end) &&
          dem2di_side_excludes(pair, eval, 0, rho[0], end[0], 1, allowed) &&
          dem2di_side_excludes(pair, eval, 1, rho[1], end[1], 1, allowed)))
        return false;
    search->lower = search->upper - dem2di_face_gap(eval) - allowed;
    search->proof = DEM2D_BY_ARC;
    return true;
}

/* Greatest distance of the parts of both shapes from the caller's arcs. */
static double dem2di_pair_deviation(const dem2di_pair *pair) {
    return pair->a->deviation * pair->scale_a + pair->b->deviation * pair->scale_b;
}

/* An evaluation of the bisection below: h and its slope in the sense of rotation of the search. */
typedef struct dem2di_probe {
    dem2d_vec u;
    dem2di_vertex v;
    double h, slope;
} dem2di_probe;

static bool dem2di_probe_at(dem2di_pair *pair, dem2d_vec direction, int turn, dem2di_probe *f) {
    if (!dem2di_unit(direction, &f->u)) return false;
    dem2di_minkowski(pair, f->u, NULL, &f->v);
    f->h = dem2di_dot(f->v.w, f->u);
    f->slope = turn * dem2di_cross(f->u, f->v.w);
    return true;
}

/* From the direction of the least value to a minimum beside it, by bisection down to rounding
   errors: for outlines on which Newton's steps do not converge. h falls at `near`, and is higher or
   rises at `far`, so there is a minimum between them. The support points of the last two directions
   are the ends of an edge, or of so short an arc that its chord is on the outline (length x angle /
   8). */
static void dem2di_branch_bisect(dem2di_pair *pair, dem2di_search *search) {
    /* the values also have the deviation of the shapes */
    const double roundoff = DEM2DI_ROUNDOFF * pair->size + dem2di_pair_deviation(pair);
    dem2di_probe near, far, at;
    if (!dem2di_probe_at(pair, search->normal, 1, &near)) return;
    int turn = near.slope < 0 ? 1 : -1;
    near.slope *= turn;
    far = near;
    bool between = false;
    for (double angle = 4 * DBL_EPSILON; angle < 1 && !between; angle *= 8) {
        dem2d_vec direction = dem2di_along(near.u, turn * angle, dem2di_perp(near.u));
        if (!dem2di_probe_at(pair, direction, turn, &far)) return;
        between = far.slope >= 0 || far.h > near.h + roundoff;
        if (!between) near = far;
    }
    while (between && dem2di_probe_at(pair, dem2di_add(near.u, far.u), turn, &at)) {
        bool last = turn * dem2di_cross(near.u, far.u) <= 2 * DBL_EPSILON;
        *(at.slope >= 0 || at.h > near.h + roundoff ? &far : &near) = at;
        if (last) break;
    }
    search->normal = near.h < far.h ? near.u : far.u;
    search->upper = dem2di_min(near.h, far.h);
    search->lower = dem2di_min(search->lower, search->upper);
    dem2di_witness(search, &near.v, &far.v);
}

/* From the direction of the least value to a stationary one, as exactly as the shapes allow. False
   if there is none whose value is within the tolerance and has the certain sign. */
static bool dem2di_branch_refine(dem2di_pair *pair, double tolerance, double angle, int cap,
                                 dem2di_search *search) {
    double roundoff = DEM2DI_ROUNDOFF * pair->size, most = search->upper + tolerance;
    if (search->upper < -roundoff) most = dem2di_min(most, -roundoff);
    dem2di_eval eval;
    dem2di_search last = *search;
    if (dem2di_has_core(pair->a) && dem2di_has_core(pair->b)) {
        (void)dem2di_edges_solve(pair, search->normal, true, &last);
        if (last.upper > most) return false;
        last.lower = dem2di_min(last.upper, search->lower);
    } else {
        if (!dem2di_descend(pair, search->normal, false, angle, cap, false, &eval, &last))
            return false;
        dem2di_descend_finish(&eval, &last);
        if (last.upper > most) return false;
        /* Newton's last step gives a value that was not attained: it widens the lower bound, too */
        last.upper = dem2di_max(last.upper, search->lower);
        last.lower = dem2di_min(search->lower, 2 * last.upper - eval.h);
    }
    *search = last;
    return true;
}

/* Branch and bound over arcs of directions, from the least value so far; then to a stationary
   direction. */
static void dem2di_branch(dem2di_pair *pair, double tolerance, double angle, int cap,
                          dem2di_search *search) {
    dem2di_polytope polytope;
    dem2d_vec end[2], u = search->normal;
    (void)dem2di_unit(search->normal, &u); /* steps and starts change the length */
    polytope.vertices = polytope.edges = 0;
    polytope.arcs = true;
    search->upper = HUGE_VAL; /* evaluate the least value again, with its witness points */
    (void)dem2di_evaluate(pair, search, u);
    bool cone = dem2di_cone(pair, search->upper, end) && dem2di_dot(end[0], end[1]) > -0.9;
    if (cone) {
        bool inside = dem2di_inside(u, end[0], end[1]);
        for (int i = 0; i < 3; i++) {
            dem2d_vec v = i == 0 ? end[0] : i == 1 ? u : end[1];
            if (i == 1 && !inside) continue;
            dem2di_polytope_push(pair, &polytope, dem2di_evaluate(pair, search, v), v);
        }
    } else {
        for (int i = 0; i < 4; i++, u = dem2di_perp(u))
            dem2di_polytope_push(pair, &polytope, dem2di_evaluate(pair, search, u), u);
        dem2di_polytope_close(pair, &polytope);
    }
    dem2di_epa(pair, &polytope, tolerance, cap, search);
    bool unresolved = search->state == DEM2D_UNRESOLVED;
    if (unresolved || !dem2di_branch_refine(pair, tolerance, angle, cap, search))
        dem2di_branch_bisect(pair, search);
    if (unresolved) return;
    search->proof = DEM2D_BY_POLYTOPE;
    search->state = dem2di_state_of(pair, search);
}

/* Limit of evaluations from a warm start: two for the normal of the last step, and some more for
   corners passed and edges turned. */
#define DEM2DI_WARM_EVALUATIONS 6

/* What a search is held to. Newton's last step leaves an error of about its angle squared in the
   normal: a hundredth of the tolerance, or a tenth in a time step (`detect`), where that saves
   every fifth evaluation. */
typedef struct dem2di_demand {
    double tolerance; /* m */
    double angle;     /* a stationary direction may be this far from a minimum */
    bool detect;      /* any separating direction is enough */
} dem2di_demand;

static inline dem2di_demand dem2di_demand_of(const dem2di_pair *pair, double tolerance,
                                             bool detect) {
    dem2di_demand demand;
    double relative = dem2di_max(tolerance, DEM2DI_ROUNDOFF);
    demand.tolerance = relative * pair->size;
    demand.angle = (detect ? 0.3 : 0.1) * sqrt(relative);
    demand.detect = detect;
    return demand;
}

/* Is an evaluation of a pair without edges at the minimum, with all that dem2di_descend,
   dem2di_descend_finish and dem2di_certify would ask of it, and the radius as proof? True only if
   these would end there with the same bits: the conditions are theirs or stricter (the product in
   place of a quotient: by 1e-9, where rounding is 1e-15). */
static DEM2DI_INLINE bool dem2di_rests_by_radius(const dem2di_pair *pair, const dem2di_eval *eval,
                                                 const dem2di_demand *demand,
                                                 dem2di_search *search) {
    const dem2d_shape *a = pair->a, *b = pair->b;
    const double h = eval->h, square = eval->slope[0] * eval->slope[0];
    const double bend = eval->rho[0] + eval->rho[1] - h, turn = demand->angle * bend;
    const double least_a = a->rho_min * pair->scale_a, least_b = b->rho_min * pair->scale_b;
    const double most = a->rho_max * pair->scale_a + b->rho_max * pair->scale_b;
    const double room = least_a + least_b - h, roundoff = DEM2DI_ROUNDOFF * pair->size;
    bool stationary = dem2di_curves_up(pair, bend) & (fabs(eval->slope[0]) <= turn) &
                      (square <= demand->angle * demand->angle * bend * pair->size);
    bool smooth = ((square * most) * (1 + 1e-9) <= 2 * pair->size * (turn * turn)) &
                  (square <= 1e-10 * dem2di_min(least_a, least_b) * pair->size);
    bool proved = (room > 0) & (square <= 2 * demand->tolerance * room);
    if (!(stationary & smooth & proved) || (demand->detect && h < -roundoff)) return false;
    dem2di_descend_finish(eval, search);
    search->lower = search->upper - square / (2 * room);
    search->proof = DEM2D_BY_RADIUS;
    return !(h >= -roundoff && search->lower < -roundoff);
}

/* Try the direction of the last step for a pair without edges; false if it is not known to be the
   answer. */
static DEM2DI_INLINE bool dem2di_smooth_last(dem2di_pair *pair, dem2d_vec start,
                                             const dem2di_demand *demand, dem2di_eval *eval,
                                             dem2di_search *search) {
    dem2di_eval_smooth(pair, start, eval);
    if (dem2di_edges_unknown(pair->a) || dem2di_edges_unknown(pair->b)) return false;
    eval->no_step = false;
    search->iterations = 1;
    dem2di_feature_clear(search);
    return dem2di_rests_by_radius(pair, eval, demand, search);
}

/* Least overlap or greatest gap, certified, where neither dem2di_edge_last nor dem2di_smooth_last
   found it; for pairs without edges the latter has evaluated the start. */
static void dem2di_certified(dem2di_pair *pair, dem2d_vec start, const dem2di_demand *demand,
                             int cap, dem2di_eval *eval, dem2di_search *search) {
    /* 64 evaluations are more than bisection of the cone needs */
    double absolute = demand->tolerance, angle = demand->angle;
    if (dem2di_edges_unknown(pair->a) || dem2di_edges_unknown(pair->b)) angle *= 0.01;
    search->iterations = 0;
    search->upper = HUGE_VAL;
    search->normal = start;
    dem2di_feature_clear(search);
    if (dem2di_has_core(pair->a) && dem2di_has_core(pair->b)) {
        if (dem2di_edges_solve(pair, start, false, search)) {
            search->state = dem2di_state_of(pair, search);
            return;
        }
        search->normal = start;
        dem2di_branch(pair, absolute, angle, cap, search);
        return;
    }
    /* If the start does not converge at once, start from the line of centres. If bounds within the
       tolerance leave the sign open, descend a third time, from there down to rounding errors. */
    double roundoff = DEM2DI_ROUNDOFF * pair->size;
    for (int i = 0; i < 3; i++) {
        int evaluations = i == 0 ? DEM2DI_WARM_EVALUATIONS : cap < 64 ? cap : 64;
        bool rest = dem2di_descend(pair, i == 1 ? dem2di_centres(pair) : start, i == 0, angle,
                                   evaluations, demand->detect, eval, search);
        if (demand->detect && search->upper < -roundoff) {
            search->lower = -HUGE_VAL;
            search->proof = DEM2D_BY_RADIUS;
            search->state = DEM2D_SEPARATED;
            return;
        }
        if (rest) {
            dem2di_descend_finish(eval, search);
            search->state = dem2di_state_of(pair, search);
        }
        bool proved = rest && dem2di_certify(pair, eval, absolute, search);
        bool open = proved && eval->h >= -roundoff && search->lower < -roundoff;
        if (proved && (!open || i == 2)) return;
        if (!open && i >= 1) break;
        if (!open) continue;
        start = search->normal;
        angle *= 1e-3;
        i = 1;
    }
    dem2di_branch(pair, absolute, angle, cap, search);
}

/* ============================================================================================
   >>faces  Where two faces meet: the two points that carry the contact
   uses: config, math, support, gjk, edges
   ============================================================================================ */

/* A face of a shape beside a contact along u, without the rounding radius: x is along perp(u),
   heights are along u. */
typedef struct dem2di_face {
    double x0, x1;       /* its ends, x0 < x1 */
    double near;         /* x of the contact: on the face, or on a curved end beside it */
    double top;          /* height of the shape, with the rounding radius */
    double height, rise; /* of its line: height at x = 0, slope */
    double square;       /* of its length */
    double rounding;
    int corner0, corner1; /* at its ends, as in dem2d_contact_point */
    bool endless;         /* a half-plane, which has no ends */
} dem2di_face;

/* Greatest angle (sine) between a straight arc and a contact, if the arc is to be its face: a tenth
   of a radian is a tilted face, a third is another contact. */
#define DEM2DI_FLAT_ANGLE 0.3

/* The edge beside corner k on a side (1: counter-clockwise), as a face of a contact along v; -1 if
   it is more than 45 degrees off. */
static inline int dem2di_polygon_face(const dem2d_shape *shape, dem2d_vec v, int k, int side) {
    int edge[2] = {k, dem2di_around(shape->count, k, -1)}, other = side < 0;
    double sine[2];
    for (int i = 0; i < 2; i++) {
        dem2d_vec along = shape->tangents[edge[i]];
        sine[i] = dem2di_cross(v, along) > DEM2DI_FACE_COSINE ? fabs(dem2di_dot(v, along)) : 1;
    }
    if (dem2di_min(sine[0], sine[1]) < DEM2DI_ALONG) other = sine[1] < sine[0];
    return sine[other] < 1 ? edge[other] : -1;
}

/* The straight arc beside the arc at v on a side, as a face of a contact along v, or -1. Chosen as
   with edges, so that a face that turns away is replaced by the next one where both have the same
   energy. */
static int dem2di_arc_face(const dem2d_shape *shape, dem2d_vec v, int side) {
    int k = dem2di_sector_find(shape, v), edge[2];
    double sine[2];
    for (int i = 0; i < 2; i++) {
        edge[i] = dem2di_edge_beside(shape, k, i ? -side : side);
        dem2d_vec along = shape->tangents[edge[i]];
        sine[i] = dem2di_cross(v, along) > 0 ? fabs(dem2di_dot(along, v)) : 1;
    }
    int other = sine[1] < DEM2DI_ALONG && sine[1] < sine[0];
    return sine[other] < DEM2DI_FLAT_ANGLE ? edge[other] : -1;
}

/* The edge or straight arc of a shape that is its face towards v on a side, or -1. For a polygon,
   `corner` is the support corner, or -1 if it is not known. */
static inline int dem2di_face_find(const dem2d_shape *shape, dem2d_vec v, int corner, int side) {
    if (shape->type != DEM2D_POLYGON) return dem2di_arc_face(shape, v, side);
    return dem2di_polygon_face(shape, v, corner < 0 ? dem2di_polygon_corner(shape, v) : corner,
                               side);
}

/* The face on edge `found` of a shape with a scale, relative to its centre. */
static void dem2di_face_set(const dem2d_shape *shape, double scale, dem2d_vec v, int found,
                            dem2di_face *face) {
    dem2d_vec from = dem2di_edge_end(shape, found, false);
    dem2d_vec along = dem2di_sub(dem2di_edge_end(shape, found, true), from), support;
    if (shape->type == DEM2D_POLYGON)
        support = dem2di_along(from, dem2di_dot(v, along) > 0, along);
    else
        support = dem2di_arc_support(&shape->arcs[dem2di_sector_find(shape, v)], v, NULL);
    double x0 = dem2di_cross(v, from), width = dem2di_cross(v, along);
    face->rise = dem2di_dot(v, along) / width;
    face->x0 = x0 * scale;
    face->x1 = (x0 + width) * scale;
    face->near = dem2di_cross(v, support) * scale;
    face->top = (dem2di_dot(v, support) + shape->rounding) * scale;
    face->height = (dem2di_dot(v, from) - face->rise * x0) * scale;
    face->square = dem2di_dot(along, along) * (scale * scale);
    face->rounding = shape->rounding * scale;
    face->endless = false;
    /* a corner between two faces has the number of the face before it */
    face->corner0 = 2 * dem2di_edge_beside(shape, dem2di_edge_part(shape, found, -1), -1);
    face->corner1 = 2 * found;
    if (face->corner0 == face->corner1) face->corner0 += 2 * shape->parts; /* the only face */
}

/* Transform B's face towards -u to heights along u relative to A's centre. */
static void dem2di_face_turn(dem2d_vec d, dem2d_vec u, dem2di_face *face) {
    double place = dem2di_cross(u, d), left = place - face->x1;
    face->height = dem2di_dot(u, d) - (face->height + face->rise * place);
    face->x1 = place - face->x0;
    face->x0 = left;
    face->near = place - face->near;
    int corner = face->corner0;
    face->corner0 = face->corner1 + 1;
    face->corner1 = corner + 1;
}

static double dem2di_face_height(const dem2di_face *face, double x) {
    return face->height + face->rise * x;
}

/* The second contact point: the shallower end of the common part of two faces, where a corner of
   one shape is at a right angle to the face of the other, the base. The deeper end is the first
   point. */
typedef struct dem2di_second_point {
    int side;                  /* 1: after the deeper end, -1: before it */
    int base;                  /* whose face the base is: 0 for A, 1 for B */
    int corner, corner_deep;   /* at the second point and at the deeper end */
    double x_deep, level;      /* deeper end: x, and height of the middle between both surfaces */
    double x, core;            /* corner of the second point, without rounding radius: x, height */
    double place, y;           /* second point: x, and height of the middle between both surfaces */
    double rise;               /* slope of the base */
    double slope;              /* length of the base for each unit of x */
    double depth;              /* at a right angle to the base */
    double width;              /* along the base, between the deeper end and the corner */
    double energy;             /* over kn, in addition to that of the deeper end, depth^2/2 */
    double deep, press, slide; /* forces over kn: deeper end; second point, normal and along base */
} dem2di_second_point;

/* The deeper end: where the second of both faces begins, or the first one ends. */
static void dem2di_second_deep(const dem2di_face *a, const dem2di_face *b, int side,
                               dem2di_second_point *end) {
    double xa = side > 0 ? dem2di_min(a->x0, a->near) : dem2di_max(a->x1, a->near);
    double xb = side > 0 ? dem2di_min(b->x0, b->near) : dem2di_max(b->x1, b->near);
    bool of_a = b->endless || side * (xa - xb) >= 0;
    const dem2di_face *face = of_a ? a : b;
    end->x_deep = of_a ? xa : xb;
    end->corner_deep = side > 0 ? face->corner0 : face->corner1;
}

/* The second point on a side of two faces in contact with a depth; false if they do not overlap
   there: they are tilted by more than 45 degrees, or the other way. The base changes from one face
   to the other where both corners are on the bisector of the two normals: both overlaps are then
   equal. */
static bool dem2di_second_place(const dem2di_face *a, const dem2di_face *b, double depth,
                                double size, int side, dem2di_second_point *end) {
    double tilt = side * (b->rise - a->rise);
    if (tilt > 1) return false;
    double xa = side > 0 ? a->x1 : a->x0, xb = side > 0 ? b->x1 : b->x0;
    double from = side > 0 ? dem2di_max(a->x0, b->x0) : dem2di_min(a->x1, b->x1);
    double apart = dem2di_face_height(b, xb) - dem2di_face_height(a, xa);
    end->base = b->endless || side * ((xb - xa) + apart * (a->rise + b->rise) / 2) > 0;
    end->x = end->base ? xa : xb;
    double length = side * (end->x - from);
    if (!(length > 0) || -tilt * length > DEM2DI_ROUNDOFF * size) return false;
    end->rise = end->base ? b->rise : a->rise;
    double on_a = dem2di_face_height(a, end->x), gap = dem2di_face_height(b, end->x) - on_a;
    double radii = a->rounding + b->rounding, square = 1 + end->rise * end->rise;
    if (gap >= 0 && gap * gap >= radii * radii * square) return false;
    end->side = side;
    end->corner = side > 0 ? (end->base ? a : b)->corner1 : (end->base ? a : b)->corner0;
    end->slope = sqrt(square);
    end->depth = dem2di_min(depth, radii - gap / end->slope);
    end->core = end->base ? on_a : on_a + gap;
    end->y = on_a + a->rounding + (gap - radii) / 2;
    end->place = end->x - (end->y - end->core) * end->rise;
    dem2di_second_deep(a, b, side, end);
    end->level = a->top - depth / 2;
    double lean = side * (end->base ? -gap : gap) * end->rise;
    end->width = length * end->slope + lean / end->slope;
    return end->depth > 0 && end->width > 0;
}

/* A smooth step from 0 to 1 for x in [0, 1]: value and slope. */
static double dem2di_ramp(double x, double *slope) {
    *slope = 6 * x * (1 - x);
    return x * x * (3 - 2 * x);
}

/* The second point has its full weight if the common part is at least this part of the shorter
   face: bricks that overlap by half can slide without a change. */
#define DEM2DI_FULL_WIDTH 0.25

/* Weight of the second point by depth: it falls from 1 to 1/2 while the depth grows from a 16th of
   the shorter face to its length, because a shape with shorter faces is practically round, and to 0
   at four lengths. Over narrower ranges the force would decrease with the depth. */
static double dem2di_share_left(double length, double depth, double *slope) {
    const double log16 = 2.7725887222397811, log4 = log16 / 2;
    double share = 1;
    *slope = 0;
    if (depth >= 4 * length) return 0;
    if (depth > length) {
        share = (1 - dem2di_ramp(dem2di_log_ratio(depth, length) / log4, slope)) / 2;
        *slope /= -2 * log4 * depth;
    } else if (16 * depth > length) {
        share = (1 + dem2di_ramp(dem2di_log_ratio(length, depth) / log16, slope)) / 2;
        *slope /= -2 * log16 * depth;
    }
    return share;
}

/* Weight of the second point, 1 where two faces meet, 0 where two corners meet, and its derivatives
   by width and depth (1/m). */
static double dem2di_second_share(double square, double width, double depth, double *by_width,
                                  double *by_depth) {
    *by_width = *by_depth = 0;
    const double part = DEM2DI_FULL_WIDTH;
    if (width * width >= part * part * square && 256 * depth * depth <= square) return 1;
    double length = sqrt(square), left = dem2di_share_left(length, depth, by_depth), slope;
    if (width >= part * length) return left;
    double there = dem2di_ramp(width / (part * length), &slope);
    *by_width = left * slope / (part * length);
    *by_depth *= there;
    return left * there;
}

/* Forces of a contact with two points of depths d and s. They conserve energy, because they follow
   from the energy kn/2 (d^2 + a s^2 + b s^4/d^2). For faces a = 1, b = 0: two springs. With a
   weight c of the second point, b = 4/3 c (1 - c) and a = max(0, 2c - 1)^2. Down to c = 1/2 then a
   + 2b = 1 - b: both forces are equal if the depths are, and the moment is continuous when parallel
   faces tilt to either side. For smaller c that is impossible without attraction at one of the
   points. */
static void dem2di_second_forces(double square, double depth, dem2di_second_point *end) {
    double by_width, by_depth, s = end->depth, mean = (depth + s) / 2;
    double share = dem2di_second_share(square, end->width, mean, &by_width, &by_depth);
    double more = dem2di_max(0, 2 * share - 1), ratio = (s / depth) * (s / depth);
    double a = more * more, b = 4 * share * (1 - share) / 3;
    double by_share = s * s * (2 * more + 2 * (1 - 2 * share) / 3 * ratio);
    double by_mean = by_share * by_depth / 2;
    end->energy = s * s * (a + b * ratio) / 2;
    end->deep = depth * (1 - b * ratio * ratio) + by_mean;
    end->press = dem2di_max(0, s * (a + 2 * b * ratio) + by_mean);
    /* the width decreases if the corner moves along the base towards the deeper end */
    end->slide = by_share * by_width * end->side * (end->base ? 1 : -1);
}

/* No second point: zero energy, zero force. */
static dem2di_second_point dem2di_second_none(void) {
    dem2di_second_point none;
    memset(&none, 0, sizeof none);
    return none;
}

/* Replace the second point by that of two faces on a side if that has more energy: if three corners
   overlap two count, and the energy is continuous where the third one replaces the second. */
static void dem2di_second_try(const dem2di_face *a, const dem2di_face *b, double depth, double size,
                              int side, dem2di_second_point *best) {
    dem2di_second_point end;
    if (!dem2di_second_place(a, b, depth, size, side, &end)) return;
    dem2di_second_forces(dem2di_min(a->square, b->square), depth, &end);
    if (end.energy > best->energy) *best = end;
}

/* The two points of a contact along u, from its second point. */
static void dem2di_two_points(const dem2di_second_point *end, double depth, dem2d_vec u,
                              dem2d_contact_point points[2]) {
    dem2d_vec across = dem2di_perp(u), force; /* on B, along perp(u) and u */
    force.x = (end->slide - end->press * end->rise) / end->slope;
    force.y = (end->press + end->slide * end->rise) / end->slope;
    double size = dem2di_length(force), up = end->y - end->core;
    /* the force along the base acts at the corner: its moment moves the point of the deeper end */
    double place = end->x_deep + up * end->slope * end->slide / end->deep;
    dem2d_contact_point *one = &points[place > end->place];
    dem2d_contact_point *other = &points[!(place > end->place)];
    one->position = dem2di_along(dem2di_scale(u, end->level), place, across);
    one->normal = u;
    one->depth = depth;
    one->weight = end->deep / depth;
    one->energy = depth * depth / 2;
    one->corner = end->corner_deep;
    other->position = dem2di_along(dem2di_scale(u, end->y), end->place, across);
    other->normal = u;
    if (size > 0)
        other->normal = dem2di_along(dem2di_scale(u, force.y / size), force.x / size, across);
    other->depth = end->depth;
    other->weight = size / end->depth;
    other->energy = end->energy;
    other->corner = end->corner;
}

/* The point of a contact with one point. */
static void dem2di_one_point(dem2d_vec position, double depth, dem2d_vec u,
                             dem2d_contact_point *point) {
    point->position.x = position.x;
    point->position.y = position.y;
    point->normal.x = u.x;
    point->normal.y = u.y;
    point->depth = depth;
    point->weight = 1;
    point->energy = depth * depth / 2;
    point->corner = -1;
}

/* The second point of an overlapping pair, on either side; without one `best` is not changed. */
static void dem2di_pair_second(const dem2di_pair *pair, const dem2di_search *search,
                               dem2di_second_point *best) {
    const int *corner = search->feature.corner;
    dem2d_vec u = search->normal;
    dem2d_vec va = dem2di_turn_back(pair->ra, u), vb = dem2di_turn_back(pair->rb, dem2di_negate(u));
    for (int side = -1; side <= 1; side += 2) {
        int found_a = dem2di_face_find(pair->a, va, corner[0], side), found_b = -1;
        if (found_a >= 0) found_b = dem2di_face_find(pair->b, vb, corner[1], -side);
        if (found_b < 0) continue;
        dem2di_face a, b;
        dem2di_face_set(pair->a, pair->scale_a, va, found_a, &a);
        dem2di_face_set(pair->b, pair->scale_b, vb, found_b, &b);
        dem2di_face_turn(pair->d, u, &b);
        dem2di_second_try(&a, &b, search->upper, pair->size, side, best);
    }
    /* the only polygon with two corners is a segment wall */
    if (best->energy > 0 && pair->b->type == DEM2D_POLYGON && pair->b->count == 2) {
        best->slide = 0; /* the end of a segment may be a joint, which has no such force */
        if (best->base == 0) {
            best->place = best->x; /* joints are found by the position of their point */
            best->y = best->core + best->depth / 2;
        }
    }
}

/* Contact points of an overlapping pair, relative to A's centre. Returns their number. */
static int dem2di_pair_points(const dem2di_pair *pair, const dem2di_search *search,
                              dem2d_contact_point points[2]) {
    dem2d_vec u = search->normal;
    if (pair->a->flat && pair->b->flat && !search->alone) {
        dem2di_second_point second = dem2di_second_none();
        dem2di_pair_second(pair, search, &second);
        if (second.energy > 0) {
            dem2di_two_points(&second, search->upper, u, points);
            return 2;
        }
    }
    dem2d_vec middle = dem2di_add(search->a, dem2di_add(search->b, pair->d));
    dem2di_one_point(dem2di_scale(middle, 0.5), search->upper, u, points);
    return 1;
}

/* The same for a shape and a half-plane whose surface is at a height along u from the shape's
   centre. The points are on the surface. */
static int dem2di_wall_points(const dem2d_shape *shape, dem2d_rot q, double scale, dem2d_vec u,
                              double surface, dem2d_vec support, double depth,
                              dem2d_contact_point points[2]) {
    double size = 2 * shape->circumscribed * scale;
    dem2d_vec v = dem2di_turn_back(q, u);
    dem2di_face face, wall = {-size, size, 0, surface, surface, 0, size * size, 0, -1, -1, true};
    dem2di_second_point second = dem2di_second_none();
    for (int side = -1; side <= 1 && shape->flat; side += 2) {
        int found = dem2di_face_find(shape, v, -1, side);
        if (found < 0) continue;
        dem2di_face_set(shape, scale, v, found, &face);
        dem2di_second_try(&face, &wall, depth, size, side, &second);
    }
    if (second.energy > 0) {
        dem2di_two_points(&second, depth, u, points);
        for (int i = 0; i < 2; i++)
            points[i].position = dem2di_along(points[i].position, -points[i].depth / 2, u);
        return 2;
    }
    dem2di_one_point(dem2di_along(support, -depth, u), depth, u, points);
    return 1;
}

/* ============================================================================================
   >>contact  Contact of two shapes, of a shape and a wall
   uses: config, math, memory, fields, shapes, gjk, epa, edges, minimum, faces
   ============================================================================================ */

/* [P] sec. 3: GJK, then EPA when the shapes overlap. */
static void dem2di_gjk_epa(dem2di_pair *pair, dem2d_vec start, double tolerance, int cap,
                           bool detect, dem2di_search *search) {
    double absolute = dem2di_max(tolerance, DEM2DI_ROUNDOFF) * pair->size;
    dem2di_gjk(pair, start, absolute, cap, detect, search);
    if (search->state != DEM2D_PENETRATING) return;
    dem2di_polytope polytope;
    dem2di_polytope_start(pair, search, &polytope);
    dem2di_epa(pair, &polytope, absolute, cap, search);
    search->lower = dem2di_max(search->lower, dem2di_min(0, search->upper)); /* by GJK */
}

/* Depth of overlapping shapes, else separation (with `detect`) or distance. The feature of the last
   step (may be NULL) is tried first; it may be that of any pair, or all 0. */
static DEM2DI_INLINE void dem2di_contact_solve(dem2di_pair *pair, dem2d_solver solver,
                                               const dem2di_feature *last, dem2d_vec start,
                                               double tolerance, int cap, bool detect,
                                               dem2di_search *search) {
    if (solver == DEM2D_GJK_EPA) {
        dem2di_gjk_epa(pair, start, tolerance, cap, detect, search);
        return;
    }
    dem2di_eval eval;
    bool edges = pair->a->flat || pair->b->flat;
    search->iterations = 0;
    if (!(edges && dem2di_edge_last(pair, last, search))) {
        dem2di_demand demand = dem2di_demand_of(pair, tolerance, detect);
        if (edges || !dem2di_smooth_last(pair, start, &demand, &eval, search)) {
            dem2di_certified(pair, start, &demand, cap, &eval, search);
            return;
        }
    }
    search->state = dem2di_state_of(pair, search);
}

/* Depth of two circles in closed form, with d from centre to centre. Concentric circles get the
   normal (1, 0). */
static double dem2di_circle_contact(dem2d_vec d, double distance, double radii, dem2d_vec *normal) {
    if (distance > 1e-140) { /* its square is a normal number */
        normal->x = d.x / distance;
        normal->y = d.y / distance;
    } else if (!dem2di_unit(d, normal)) {
        *normal = dem2di_vec(1, 0);
    }
    return radii - distance;
}

/* Move the witness points to the caller's arcs. The sign of the depth is certain only outside the
   deviation of both shapes. */
static void dem2di_report_given(const dem2di_pair *pair, const dem2di_search *search,
                                dem2d_contact *contact) {
    double deviation = dem2di_pair_deviation(pair);
    contact->error += deviation;
    if (contact->state != DEM2D_UNRESOLVED && fabs(search->upper) <= deviation) {
        contact->state = DEM2D_TOUCHING;
        contact->error += fabs(search->upper); /* 0 is within it */
    }
    for (int i = 0; i < 2; i++) {
        dem2di_member m = dem2di_member_of(pair, i);
        dem2d_vec *witness = i == 0 ? &contact->point_a : &contact->point_b;
        dem2d_vec v = dem2di_member_direction(&m, search->normal),
                  old = i == 0 ? search->a : search->b;
        old = dem2di_scale(dem2di_turn_back(m.q, old), 1 / m.scale);
        dem2d_vec shift = dem2di_sub(dem2di_given_point(m.shape, v, old), old);
        *witness = dem2di_along(*witness, m.scale, dem2di_turn(m.q, shift));
    }
}

/* Error bound of a search. */
static inline double dem2di_search_error(const dem2di_pair *pair, const dem2di_search *search) {
    return dem2di_max(0, search->upper - search->lower) + DEM2DI_ROUNDOFF * pair->size;
}

static void dem2di_contact_report(const dem2di_pair *pair, const dem2di_search *search,
                                  const dem2d_pose *pose_a, const dem2d_pose *pose_b,
                                  bool skip_points, dem2d_contact *contact) {
    contact->state = search->state;
    contact->proof = search->proof;
    contact->support_calls = pair->calls;
    contact->iterations = search->iterations;
    contact->normal.x = search->normal.x;
    contact->normal.y = search->normal.y;
    contact->depth = search->upper;
    contact->error = dem2di_search_error(pair, search);
    contact->residual = search->residual;
    contact->point_a.x = pose_a->position.x + search->a.x;
    contact->point_a.y = pose_a->position.y + search->a.y;
    contact->point_b.x = pose_b->position.x + search->b.x;
    contact->point_b.y = pose_b->position.y + search->b.y;
    if (pair->a->deviation + pair->b->deviation > 0) dem2di_report_given(pair, search, contact);
    contact->point.x = (contact->point_a.x + contact->point_b.x) * 0.5;
    contact->point.y = (contact->point_a.y + contact->point_b.y) * 0.5;
    contact->count = 0;
    memset(contact->points, 0, sizeof contact->points);
    if (contact->state == DEM2D_SEPARATED || skip_points) return;
    contact->count = dem2di_pair_points(pair, search, contact->points);
    for (int i = 0; i < contact->count; i++)
        contact->points[i].position = dem2di_add(contact->points[i].position, pose_a->position);
}

/* Are squares of the size, and of its rounding error, normal numbers? */
static bool dem2di_pair_sound(const dem2di_pair *pair) {
    double square = pair->size * pair->size;
    return dem2di_finite(square) && square * DEM2DI_ROUNDOFF * DEM2DI_ROUNDOFF > DBL_MIN;
}

#define DEM2DI_CONTACT_ROWS(ROW)                                                           \
    ROW(dem2d_contact_desc, tolerance, DEM2DI_FROM_0, "- 1e-10; of R_A + R_B + |d|"),      \
        ROW(dem2d_contact_desc, max_iterations, DEM2DI_COUNT, "- 128"),                    \
        ROW(dem2d_contact_desc, start, DEM2DI_VECTOR, "- centres; any direction"),         \
        ROW(dem2d_contact_desc, solver, DEM2DI_CHOICE(DEM2D_SOLVER_COUNT), "- CERTIFIED"), \
        ROW(dem2d_contact_desc, skip_points, DEM2DI_SWITCH, "- false")

static const dem2di_field dem2di_contact_fields[] = {DEM2DI_CONTACT_ROWS(DEM2DI_ROW)};

/* The table as code: a query is too short for a walk over it. */
static bool dem2di_contact_desc_good(const dem2d_contact_desc *desc) {
    bool good = true;
#define DEM2DI_GOOD(of, field, range, text) \
    good &= dem2di_is_good(&desc->field, sizeof desc->field, range)
    (void)(DEM2DI_CONTACT_ROWS(DEM2DI_GOOD));
#undef DEM2DI_GOOD
    return good;
}

/* A checked desc with its defaults. */
static dem2d_result dem2di_contact_desc_used(const dem2d_env *env, const dem2d_contact_desc *desc,
                                             dem2d_contact_desc *used) {
    memset(used, 0, sizeof *used);
    if (desc != NULL) {
        if (!dem2di_contact_desc_good(desc))
            return dem2di_check_fields(env, DEM2DI_ALL(dem2di_contact_fields), desc);
        *used = *desc;
    }
    if (used->tolerance == 0) used->tolerance = 1e-10;
    used->tolerance = dem2di_max(used->tolerance, DEM2DI_ROUNDOFF);
    if (used->max_iterations == 0) used->max_iterations = 128;
    return DEM2D_OK;
}

/* Checks of all queries of one pair. */
static dem2d_result dem2di_query_prepare(const dem2d_shape *a, dem2d_pose *pose_a,
                                         const dem2d_shape *b, dem2d_pose *pose_b,
                                         const dem2d_contact_desc *desc,
                                         const dem2d_contact *contact, dem2d_contact_desc *used) {
    if (a == NULL || b == NULL || contact == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_pose(pose_a);
    if (result == DEM2D_OK) result = dem2di_check_pose(pose_b);
    if (result != DEM2D_OK) return result;
    return dem2di_contact_desc_used(NULL, desc, used);
}

DEM2D_API dem2d_result dem2d_shape_contains(const dem2d_shape *shape, dem2d_pose pose,
                                            dem2d_vec point, bool *inside) {
    if (shape == NULL || inside == NULL) return DEM2D_NULL_ARGUMENT;
    if (!dem2di_vec_finite(point)) return DEM2D_NOT_FINITE;
    dem2d_result result = dem2di_check_pose(&pose);
    if (result != DEM2D_OK) return result;
    dem2d_shape dot; /* a circle of radius 0 */
    memset(&dot, 0, sizeof dot);
    dem2d_pose there = pose;
    there.position = point;
    dem2di_pair pair = dem2di_pair_make(shape, &pose, &dot, &there);
    if (!dem2di_pair_sound(&pair)) return DEM2D_OUT_OF_RANGE;
    dem2di_search search;
    dem2di_gjk(&pair, dem2di_centres(&pair), 0, 128, true, &search);
    *inside = search.state != DEM2D_SEPARATED;
    return DEM2D_OK;
}

/* The first direction of a query: the caller's, else the line of centres. */
static dem2d_vec dem2di_start(const dem2di_pair *pair, dem2d_vec start) {
    dem2d_vec u;
    if (dem2di_is_unit(start.x, start.y)) return start;
    return dem2di_unit(start, &u) ? u : dem2di_centres(pair);
}

/* A query by GJK alone: overlap (`detect`) or distance. */
static dem2d_result dem2di_query_gjk(const dem2d_shape *a, dem2d_pose pose_a, const dem2d_shape *b,
                                     dem2d_pose pose_b, const dem2d_contact_desc *desc, bool detect,
                                     dem2d_contact *contact) {
    dem2d_contact_desc used;
    dem2d_result result = dem2di_query_prepare(a, &pose_a, b, &pose_b, desc, contact, &used);
    if (result != DEM2D_OK) return result;
    dem2di_pair pair = dem2di_pair_make(a, &pose_a, b, &pose_b);
    if (!dem2di_pair_sound(&pair)) return DEM2D_OUT_OF_RANGE;
    dem2di_search search;
    search.residual = 0;
    dem2di_gjk(&pair, dem2di_start(&pair, used.start), used.tolerance * pair.size,
               used.max_iterations, detect, &search);
    if (search.state == DEM2D_PENETRATING && search.upper <= DEM2DI_ROUNDOFF * pair.size)
        search.state = DEM2D_TOUCHING;
    dem2di_contact_report(&pair, &search, &pose_a, &pose_b, used.skip_points, contact);
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_pair_overlap(const dem2d_shape *a, dem2d_pose pose_a,
                                          const dem2d_shape *b, dem2d_pose pose_b,
                                          const dem2d_contact_desc *desc, dem2d_contact *contact) {
    return dem2di_query_gjk(a, pose_a, b, pose_b, desc, true, contact);
}

DEM2D_API dem2d_result dem2d_pair_distance(const dem2d_shape *a, dem2d_pose pose_a,
                                           const dem2d_shape *b, dem2d_pose pose_b,
                                           const dem2d_contact_desc *desc, dem2d_contact *contact) {
    return dem2di_query_gjk(a, pose_a, b, pose_b, desc, false, contact);
}

/* The search of a contact query. */
static DEM2DI_INLINE void dem2di_query_solve(dem2di_pair *pair, const dem2d_contact_desc *used,
                                             const dem2di_feature *last, dem2d_vec start,
                                             dem2di_search *search) {
    search->residual = 0;
    if (pair->a->type != DEM2D_CIRCLE || pair->b->type != DEM2D_CIRCLE ||
        used->solver != DEM2D_CERTIFIED) {
        dem2di_contact_solve(pair, used->solver, last, start, used->tolerance, used->max_iterations,
                             false, search);
        return;
    }
    double ra = pair->a->a * pair->scale_a, rb = pair->b->a * pair->scale_b;
    search->iterations = 0;
    search->upper = search->lower =
        dem2di_circle_contact(pair->d, pair->distance, ra + rb, &search->normal);
    search->a = dem2di_scale(search->normal, ra);
    search->b = dem2di_scale(search->normal, -rb);
    search->proof = DEM2D_BY_FORM;
    search->state = dem2di_state_of(pair, search);
}

DEM2D_API dem2d_result dem2d_pair_contact(const dem2d_shape *a, dem2d_pose pose_a,
                                          const dem2d_shape *b, dem2d_pose pose_b,
                                          const dem2d_contact_desc *desc, dem2d_contact *contact) {
    dem2d_contact_desc used;
    dem2d_result result = dem2di_query_prepare(a, &pose_a, b, &pose_b, desc, contact, &used);
    if (result != DEM2D_OK) return result;
    dem2di_pair pair = dem2di_pair_make(a, &pose_a, b, &pose_b);
    if (!dem2di_pair_sound(&pair)) return DEM2D_OUT_OF_RANGE;
    dem2di_search search;
    dem2di_query_solve(&pair, &used, NULL, dem2di_start(&pair, used.start), &search);
    dem2di_contact_report(&pair, &search, &pose_a, &pose_b, used.skip_points, contact);
    return DEM2D_OK;
}

/* --- many pairs at once --- */

/* Radii and coordinates for which dem2di_pair_sound is true of any pair: its size is 2e-138 at
   least, whose square times ROUNDOFF^2 is 5e-305, and 2 + 2 sqrt(2) times 1e153 at most, whose
   square is 2.4e307. */
#define DEM2DI_BODY_LEAST 1e-138
#define DEM2DI_BODY_MOST 1e153

/* Radius of the bounding circle of a body. */
static inline double dem2di_body_radius(const dem2d_body *body) {
    return body->shape->circumscribed * body->pose.scale;
}

static inline bool dem2di_body_in_range(const dem2d_body *body) {
    const double radius = dem2di_body_radius(body), most = DEM2DI_BODY_MOST;
    return (radius >= DEM2DI_BODY_LEAST) & (radius <= most) &
           (fabs(body->pose.position.x) <= most) & (fabs(body->pose.position.y) <= most);
}

static dem2d_result dem2di_check_body(const dem2d_env *env, const dem2d_body *body, int i) {
    dem2d_pose pose = body->pose;
    if (body->shape == NULL)
        return dem2di_fail(env, DEM2D_NULL_ARGUMENT, i, "bodies[%d].shape is NULL", i);
    dem2d_result result = dem2di_check_pose(&pose);
    if (result != DEM2D_OK)
        return dem2di_fail(
            env, result, i, "bodies[%d].pose: position (%g, %g), rotation (%g, %g), scale %g", i,
            pose.position.x, pose.position.y, pose.rotation.c, pose.rotation.s, pose.scale);
    if (!dem2di_body_in_range(body))
        return dem2di_fail(env, DEM2D_OUT_OF_RANGE, i,
                           "bodies[%d]: radius %g at (%g, %g) is not between %g and %g", i,
                           dem2di_body_radius(body), pose.position.x, pose.position.y,
                           DEM2DI_BODY_LEAST, DEM2DI_BODY_MOST);
    return DEM2D_OK;
}

/* *unit: all rotations are of length 1. A body whose numbers are all in range needs no second
   look. */
static dem2d_result dem2di_check_bodies(const dem2d_env *env, const dem2d_body *bodies, int count,
                                        bool *unit) {
    *unit = true;
    for (int i = 0; i < count; i++) {
        const dem2d_rot *q = &bodies[i].pose.rotation;
        const bool normalised = dem2di_is_unit(q->c, q->s);
        if (bodies[i].shape != NULL && (normalised & (bodies[i].pose.scale > 0)) &&
            dem2di_body_in_range(&bodies[i]))
            continue;
        dem2d_result result = dem2di_check_body(env, &bodies[i], i);
        if (result != DEM2D_OK) return result;
        *unit = *unit && normalised;
    }
    return DEM2D_OK;
}

static dem2d_result dem2di_check_body_pairs(const dem2d_env *env, const dem2d_body_pair *pairs,
                                            int count, int bodies) {
    for (int i = 0; i < count; i++) {
        const int a = pairs[i].a, b = pairs[i].b;
        if (a < 0 || a >= bodies || b < 0 || b >= bodies || a == b)
            return dem2di_fail(env, DEM2D_OUT_OF_RANGE, i,
                               "pairs[%d] = {%d, %d}: not two of %d bodies", i, a, b, bodies);
    }
    return DEM2D_OK;
}

/* A checked body with its rotation normalised. */
static dem2d_body dem2di_body_normal(const dem2d_body *given) {
    dem2d_body body = *given;
    (void)dem2di_check_pose(&body.pose);
    return body;
}

/* The start of a search, and its feature or NULL, from the memory of the pair. */
static inline dem2d_vec dem2di_memory_start(const dem2di_pair *pair,
                                            const dem2d_contact_memory *memory, dem2d_vec start,
                                            dem2di_feature *feature) {
    feature->own = -1;
    if (memory == NULL || !dem2di_is_unit(memory->normal.x, memory->normal.y))
        return dem2di_start(pair, start);
    feature->own = memory->feature[0];
    feature->corner[0] = memory->feature[1];
    feature->corner[1] = memory->feature[2];
    return memory->normal;
}

static inline void dem2di_memory_keep(const dem2di_search *search, dem2d_contact_memory *memory) {
    memory->normal.x = search->normal.x;
    memory->normal.y = search->normal.y;
    memory->feature[0] = search->feature.own;
    memory->feature[1] = search->feature.corner[0];
    memory->feature[2] = search->feature.corner[1];
}

static void dem2di_overlap_of(const dem2d_contact *contact, dem2d_overlap *overlap) {
    overlap->normal = contact->normal;
    overlap->point = contact->point;
    overlap->depth = contact->depth;
    overlap->error = contact->error;
    overlap->state = contact->state;
}

/* The short answer, where it is not part of a long one. */
static inline void dem2di_overlap_report(const dem2di_pair *pair, const dem2di_search *search,
                                         const dem2d_pose *a, const dem2d_pose *b,
                                         dem2d_overlap *overlap) {
    if (pair->a->deviation + pair->b->deviation > 0) {
        dem2d_contact contact;
        dem2di_contact_report(pair, search, a, b, true, &contact);
        dem2di_overlap_of(&contact, overlap);
        return;
    }
    overlap->normal.x = search->normal.x;
    overlap->normal.y = search->normal.y;
    overlap->point.x = ((a->position.x + search->a.x) + (b->position.x + search->b.x)) * 0.5;
    overlap->point.y = ((a->position.y + search->a.y) + (b->position.y + search->b.y)) * 0.5;
    overlap->depth = search->upper;
    overlap->error = dem2di_search_error(pair, search);
    overlap->state = search->state;
}

/* What is asked of all pairs. */
typedef struct dem2di_array_query {
    const dem2d_body *bodies;
    const dem2d_body_pair *pairs;
    dem2d_contact_desc used;
    dem2d_contact_memory *memory;
    dem2d_overlap *overlaps;
    dem2d_contact *contacts;
} dem2di_array_query;

/* Two circles: as dem2di_query_solve and the report, of which little is left. */
static inline void dem2di_overlap_circles(const dem2d_body *a, const dem2d_body *b,
                                          dem2d_overlap *overlap) {
    const double ra = dem2di_body_radius(a), rb = dem2di_body_radius(b);
    const dem2d_vec pa = a->pose.position, pb = b->pose.position;
    dem2d_vec d = dem2di_centre_line(pa, pb), n;
    double distance = dem2di_length(d);
    overlap->depth = dem2di_circle_contact(d, distance, ra + rb, &n);
    overlap->error = DEM2DI_ROUNDOFF * (ra + rb + distance);
    overlap->state = overlap->depth < -overlap->error  ? DEM2D_SEPARATED
                     : overlap->depth > overlap->error ? DEM2D_PENETRATING
                                                       : DEM2D_TOUCHING;
    overlap->normal.x = n.x;
    overlap->normal.y = n.y;
    overlap->point.x = ((pa.x + n.x * ra) + (pb.x - n.x * rb)) * 0.5;
    overlap->point.y = ((pa.y + n.y * ra) + (pb.y - n.y * rb)) * 0.5;
}

static void dem2di_pairs_query(const dem2di_array_query *query, int i, const dem2d_body *a,
                               const dem2d_body *b) {
    const dem2d_contact_desc *used = &query->used;
    dem2d_contact_memory *memory = query->memory != NULL ? &query->memory[i] : NULL;
    dem2d_overlap *overlap = query->overlaps != NULL ? &query->overlaps[i] : NULL;
    dem2di_pair pair;
    dem2di_feature feature;
    dem2di_search search;
    dem2di_pair_set(a->shape, &a->pose, b->shape, &b->pose, &pair);
    dem2d_vec start = dem2di_memory_start(&pair, memory, used->start, &feature);
    dem2di_feature_clear(&search);
    dem2di_query_solve(&pair, used, &feature, start, &search);
    if (memory != NULL) dem2di_memory_keep(&search, memory);
    if (query->contacts != NULL) {
        dem2d_contact *contact = &query->contacts[i];
        dem2di_contact_report(&pair, &search, &a->pose, &b->pose, used->skip_points, contact);
        if (overlap != NULL) dem2di_overlap_of(contact, overlap);
    } else {
        dem2di_overlap_report(&pair, &search, &a->pose, &b->pose, overlap);
    }
}

DEM2D_API dem2d_result dem2d_pairs_contact(const dem2d_env *env, const dem2d_body *bodies,
                                           int body_count, const dem2d_body_pair *pairs,
                                           int pair_count, const dem2d_contact_desc *desc,
                                           dem2d_contact_memory *memory, dem2d_overlap *overlaps,
                                           dem2d_contact *contacts) {
    if (bodies == NULL) return dem2di_fail_null(env, "bodies");
    if (pairs == NULL) return dem2di_fail_null(env, "pairs");
    if (overlaps == NULL && contacts == NULL)
        return dem2di_fail_null(env, "one of overlaps and contacts is needed: each");
    if (body_count < 0 || pair_count < 0)
        return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "%s: their count is %d",
                           body_count < 0 ? "bodies" : "pairs",
                           body_count < 0 ? body_count : pair_count);
    dem2di_array_query query = {bodies, pairs,    {0, 0, {0, 0}, DEM2D_CERTIFIED, false},
                                memory, overlaps, contacts};
    bool unit;
    dem2d_result result = dem2di_contact_desc_used(env, desc, &query.used);
    if (result == DEM2D_OK) result = dem2di_check_bodies(env, bodies, body_count, &unit);
    if (result == DEM2D_OK) result = dem2di_check_body_pairs(env, pairs, pair_count, body_count);
    if (result != DEM2D_OK) return result;
    const bool circles = query.used.solver == DEM2D_CERTIFIED && contacts == NULL;
    for (int i = 0; i < pair_count; i++) {
        const dem2d_body *a = &bodies[pairs[i].a], *b = &bodies[pairs[i].b];
        if (circles && a->shape->type == DEM2D_CIRCLE && b->shape->type == DEM2D_CIRCLE) {
            dem2di_overlap_circles(a, b, &overlaps[i]);
        } else if (unit) {
            dem2di_pairs_query(&query, i, a, b);
        } else {
            dem2d_body own_a = dem2di_body_normal(a), own_b = dem2di_body_normal(b);
            dem2di_pairs_query(&query, i, &own_a, &own_b);
        }
    }
    return DEM2D_OK;
}

/* Overlap of a shape at a pose with the half-plane through `point` with the outward unit normal -u.
   `support` is the support point along u, relative to the shape's centre. */
static double dem2di_wall_depth(const dem2d_pose *pose, dem2d_vec point, dem2d_vec u,
                                dem2d_vec support) {
    return dem2di_dot(dem2di_add(dem2di_sub(pose->position, point), support), u);
}

DEM2D_API dem2d_result dem2d_wall_contact(const dem2d_shape *shape, dem2d_pose pose,
                                          dem2d_vec point, dem2d_vec wall_normal,
                                          dem2d_contact *contact) {
    if (shape == NULL || contact == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_pose(&pose);
    if (result != DEM2D_OK) return result;
    if (!dem2di_vec_finite(point) || !dem2di_vec_finite(wall_normal)) return DEM2D_NOT_FINITE;
    dem2d_vec u, support;
    if (!dem2di_unit(dem2di_negate(wall_normal), &u)) return DEM2D_OUT_OF_RANGE;
    support = dem2di_posed_given(shape, &pose, u, NULL);
    double depth = dem2di_wall_depth(&pose, point, u, support);
    double size =
        shape->circumscribed * pose.scale + fabs(dem2di_dot(dem2di_sub(pose.position, point), u));
    double roundoff = DEM2DI_ROUNDOFF * size;
    contact->state = depth < -roundoff  ? DEM2D_SEPARATED
                     : depth > roundoff ? DEM2D_PENETRATING
                                        : DEM2D_TOUCHING;
    contact->support_calls = 1;
    contact->iterations = 0;
    contact->normal = u;
    contact->depth = depth;
    contact->error = roundoff;
    contact->residual = 0;
    contact->point_a = dem2di_add(pose.position, support);
    contact->point = contact->point_b = dem2di_along(contact->point_a, -depth, u);
    contact->proof = DEM2D_BY_FORM;
    contact->count = 0;
    memset(contact->points, 0, sizeof contact->points);
    if (contact->state == DEM2D_SEPARATED) return DEM2D_OK;
    contact->count = dem2di_wall_points(shape, pose.rotation, pose.scale, u,
                                        dem2di_dot(dem2di_sub(point, pose.position), u), support,
                                        depth, contact->points);
    for (int i = 0; i < contact->count; i++)
        contact->points[i].position = dem2di_add(contact->points[i].position, pose.position);
    return DEM2D_OK;
}

/* ============================================================================================
   >>broad  Candidate pairs from cell grids, one per power of two of the size; sorting in space
   uses: config, math
   ============================================================================================ */

/* A pair: slots of two particles, the one of lower rank first; or a particle and a wall. */
typedef struct dem2di_key {
    int a, b;
} dem2di_key;

typedef struct dem2di_disc {
    dem2d_vec centre;
    double reach; /* bounding radius and skin */
    int level;    /* its cells are 2^-level of the largest, at least twice its reach */
    bool fixed;   /* two fixed ones are no pair */
    bool circle;  /* two circles are a pair of the first kind, others of the second */
} dem2di_disc;

/* The discs sorted by the cells of their centres, with a hash table of cells. The arrays are the
   caller's. */
typedef struct dem2di_grid {
    dem2di_disc *discs;
    int *slot;   /* for each disc its slot of the table; after the sort its index in sorted */
    int *sorted; /* discs by slot */
    int *heads;  /* table + 1: where each slot begins in sorted */
    int count, table;
    double size;      /* of the cells of level 0 */
    dem2d_vec origin; /* cells are counted from here, so that distant scenes keep their digits */
    uint32_t levels;  /* bit mask of the levels in use */
} dem2di_grid;

#define DEM2DI_LEVELS 31

/* Cells are a little wider than two reaches, so that in spite of rounding errors of cell numbers up
   to 2^42 two discs that overlap are at most one cell apart. */
#define DEM2DI_CELL (2 * (1 + 1.0 / 1024))

/* Slots for `count` discs: a power of two, with about one disc in each slot. */
static int dem2di_grid_table(int count) {
    int table = 64;
    while (table < count) table *= 2;
    return table;
}

static double dem2di_cell_size(const dem2di_grid *grid, int level) {
    return grid->size / (double)((uint32_t)1 << level);
}

/* Cell number of a coordinate. From 2^62 cells on all coordinates share a cell: slow but
   correct. */
static inline int64_t dem2di_cell_of(double coordinate, double size) {
    double cell = coordinate / size, limit = 4611686018427387904.0;
    if (!(fabs(cell) < limit)) return cell > 0 ? (int64_t)1 << 62 : -((int64_t)1 << 62);
    int64_t whole = (int64_t)cell;
    return whole - (cell < (double)whole);
}

typedef struct dem2di_cell {
    int64_t x, y;
} dem2di_cell;

static inline dem2di_cell dem2di_cell_at(const dem2di_grid *grid, dem2d_vec point, double size) {
    dem2di_cell cell;
    cell.x = dem2di_cell_of(point.x - grid->origin.x, size);
    cell.y = dem2di_cell_of(point.y - grid->origin.y, size);
    return cell;
}

/* Slot of a cell: a hash scatters squares of 8 x 8 cells; the cells of a square are consecutive, so
   that neighbours in space are neighbours in memory. No two of 8 cells in a row share a slot,
   whatever the hash is. */
static int dem2di_cell_slot(const dem2di_grid *grid, int64_t x, int64_t y, int level) {
    uint64_t cx = (uint64_t)x, cy = (uint64_t)y;
    uint64_t h = (cx >> 3) * 0x9E3779B97F4A7C15u; /* 2^64 / golden ratio, and a shift between */
    h = (h ^ (h >> 32) ^ (cy >> 3)) * 0x9E3779B97F4A7C15u;
    h = (h ^ (h >> 29) ^ (uint64_t)level) * 0x9E3779B97F4A7C15u;
    uint64_t slot = (h >> 32) << 6 | (cy & 7) << 3 | (cx & 7);
    return (int)(slot & (uint64_t)(grid->table - 1));
}

/* Level and slot of the discs from begin to end. */
static void dem2di_grid_place(const dem2di_grid *grid, int begin, int end) {
    for (int i = begin; i < end; i++) {
        dem2di_disc *disc = &grid->discs[i];
        double size = grid->size;
        disc->level = 0;
        while (disc->reach * (2 * DEM2DI_CELL) <= size && disc->level < DEM2DI_LEVELS - 1) {
            size /= 2;
            disc->level++;
        }
        dem2di_cell cell = dem2di_cell_at(grid, disc->centre, size);
        grid->slot[i] = dem2di_cell_slot(grid, cell.x, cell.y, disc->level);
    }
}

/* Exclusive prefix sums: each number becomes the sum of those before it. Returns the sum of all. */
static int dem2di_starts(int *numbers, int count) {
    int sum = 0;
    for (int i = 0; i < count; i++) {
        int number = numbers[i];
        numbers[i] = sum;
        sum += number;
    }
    return sum;
}

/* Counting sort by slot; in a slot the order of the discs stays. */
static void dem2di_grid_sort(dem2di_grid *grid) {
    grid->levels = 0;
    memset(grid->heads, 0, ((size_t)grid->table + 1) * sizeof *grid->heads);
    for (int i = 0; i < grid->count; i++) {
        grid->levels |= (uint32_t)1 << grid->discs[i].level;
        grid->heads[grid->slot[i] + 1]++;
    }
    for (int s = 0; s < grid->table; s++) grid->heads[s + 1] += grid->heads[s];
    for (int i = grid->count - 1; i >= 0; i--) {
        int place = --grid->heads[grid->slot[i] + 1];
        grid->sorted[place] = i;
        grid->slot[i] = place;
    }
    /* the start of slot s now stands at s + 1 */
    memmove(grid->heads, grid->heads + 1, (size_t)grid->table * sizeof *grid->heads);
    grid->heads[grid->table] = grid->count;
}

/* The partners of a disc that were found: counted by kind, and written as (own, other) if there is
   an array. */
typedef struct dem2di_finds {
    int own, count[2];
    dem2di_key *to[2]; /* or NULL */
} dem2di_finds;

/* One more partner; circles or not. */
static inline void dem2di_find_pair(dem2di_finds *finds, int other, bool circles) {
    int kind = !circles;
    if (finds->to[kind] != NULL) {
        finds->to[kind][finds->count[kind]].a = finds->own;
        finds->to[kind][finds->count[kind]].b = other;
    }
    finds->count[kind]++;
}

/* Find partners among the sorted discs from begin to end. */
static inline void dem2di_grid_range(const dem2di_grid *grid, int begin, int end, int level,
                                     dem2di_finds *finds) {
    const dem2di_disc *own = &grid->discs[finds->own];
    for (int k = begin; k < end; k++) {
        int j = grid->sorted[k];
        const dem2di_disc *other = &grid->discs[j];
        dem2d_vec d = dem2di_sub(other->centre, own->centre);
        double both = own->reach + other->reach;
        if (!(dem2di_dot(d, d) < both * both) || other->level != level) continue;
        if (own->fixed && other->fixed) continue;
        dem2di_find_pair(finds, j, own->circle && other->circle);
    }
}

/* Find partners in the cells of a row from x0 to x1; the cells of a square are done together. */
static void dem2di_grid_row(const dem2di_grid *grid, int64_t x0, int64_t x1, int64_t y, int level,
                            dem2di_finds *finds) {
    while (x0 <= x1) {
        int64_t run = 8 - (x0 & 7), left = x1 - x0 + 1;
        if (run > left) run = left;
        int slot = dem2di_cell_slot(grid, x0, y, level);
        dem2di_grid_range(grid, grid->heads[slot], grid->heads[slot + run], level, finds);
        x0 += run;
    }
}

/* Find the partners of a disc so that each pair is found once: on its own level the discs after it
   in its cell, and those in cells to the right and above; on coarser levels all around. Discs that
   overlap are at most one cell apart, so the cost is linear for any mixture of sizes. */
static void dem2di_grid_partners(const dem2di_grid *grid, dem2di_finds *finds) {
    const dem2di_disc *own = &grid->discs[finds->own];
    finds->count[0] = finds->count[1] = 0;
    for (int level = 0; level <= own->level; level++) {
        if (!(grid->levels >> level & 1)) continue;
        double size = dem2di_cell_size(grid, level);
        dem2di_cell cell = dem2di_cell_at(grid, own->centre, size);
        int64_t x = cell.x, y = cell.y;
        dem2di_grid_row(grid, x - 1, x + 1, y + 1, level, finds);
        if (level < own->level) {
            dem2di_grid_row(grid, x - 1, x + 1, y, level, finds);
            dem2di_grid_row(grid, x - 1, x + 1, y - 1, level, finds);
            continue;
        }
        int slot = dem2di_cell_slot(grid, x, y, level), place = grid->slot[finds->own];
        dem2di_grid_range(grid, place + 1, grid->heads[slot + 1], level, finds);
        dem2di_grid_row(grid, x + 1, x + 1, y, level, finds);
    }
}

/* A key to sort by, and its item. */
typedef struct dem2di_order {
    uint64_t key;
    int value;
} dem2di_order;

/* Radix sort, a byte at a time from the lowest; equal keys keep their order. */
static void dem2di_sort(dem2di_order *items, dem2di_order *spare, int count) {
    uint64_t differ = 0;
    for (int i = 1; i < count; i++) differ |= items[i].key ^ items[0].key;
    for (int shift = 0; shift < 64; shift += 8) {
        int heads[256] = {0};
        if ((differ >> shift & 255) == 0) continue;
        for (int i = 0; i < count; i++) heads[items[i].key >> shift & 255]++;
        (void)dem2di_starts(heads, 256);
        for (int i = 0; i < count; i++) spare[heads[items[i].key >> shift & 255]++] = items[i];
        memcpy(items, spare, (size_t)count * sizeof *items);
    }
}

/* The low 32 bits of x at the even bit positions. */
static uint64_t dem2di_spread_bits(uint64_t x) {
    x = (x | x << 16) & 0x0000FFFF0000FFFFu;
    x = (x | x << 8) & 0x00FF00FF00FF00FFu;
    x = (x | x << 4) & 0x0F0F0F0F0F0F0F0Fu;
    x = (x | x << 2) & 0x3333333333333333u;
    return (x | x << 1) & 0x5555555555555555u;
}

/* Position along the Z-order curve through the 2^20 x 2^20 cells of a square with a corner and a
   size. */
static uint64_t dem2di_curve_place(dem2d_vec corner, double size, dem2d_vec point) {
    double f = size > 0 ? 1048575 / size : 0;
    uint64_t x = (uint64_t)((point.x - corner.x) * f), y = (uint64_t)((point.y - corner.y) * f);
    return dem2di_spread_bits(x) | dem2di_spread_bits(y) << 1;
}

/* ============================================================================================
   >>law  Linear spring with Coulomb friction, and the critical time step
   uses: config, math, gjk
   ============================================================================================ */

/* The contact point from the centres of A and B: components along the contact's normal and along
   its tangent perp(normal). Those of a circle along the tangent are exactly 0: kernels of circles,
   which leave them out, give the same bits. Walls do not turn: their b is not used. */
typedef struct dem2di_arms {
    double a_n, a_t, b_n, b_t; /* m */
} dem2di_arms;

/* A contact as a force pass leaves it. While the two are apart there is no force, and the normal is
   that of the last search: what it was is no part of the results. */
typedef struct dem2di_contact {
    dem2d_vec normal; /* from A to B; 0 before the first search */
    double depth;     /* m; below 0 apart; 0: overlap that does not count, see joints */
    double force;     /* normal, N/m */
    double shear;     /* on B along the tangent perp(normal), N/m: that of the tangential spring */
    dem2di_arms arms;
} dem2di_contact;

/* What the next search of a pair starts from. */
typedef struct dem2di_history {
    dem2di_feature feature; /* of two polygons, that carried it: tried first in the next step */
    double bound;           /* the pair is apart until both displacements together reach this */
} dem2di_history;

/* The points of a contact of two. The contact holds their sums, as its normal that of the sum of
   the normal forces, and as its point their centre. All zero for a contact of one point. */
typedef struct dem2di_point_pair {
    double weight[2], depth[2];
    double offset[2]; /* along the tangent from the contact's point */
    double shear[2];
    double energy; /* m2: that in the normal springs over kn */
    int corner[2]; /* as in dem2d_contact_point */
} dem2di_point_pair;

/* Two numbers: of the points of a contact of two, or of a caller's law. */
typedef struct dem2di_two {
    double at[2];
} dem2di_two;

/* Terms of the law beside springs and friction, which some pair of materials in use has. With a
   caller's law all of them are in use. */
enum { DEM2DI_DASHPOT = 1, DEM2DI_ROLLING = 2, DEM2DI_CALLERS_LAW = 4, DEM2DI_TERMS = 8 };

/* How the two of a contact moved against each other in the step that was made, half a step before
   its force. */
typedef struct dem2di_relative_motion {
    dem2d_vec v;   /* of B's centre against A's */
    double wa, wb; /* a wall's is 0 */
} dem2di_relative_motion;

/* A vector in the plane of a contact whose components along normal and tangent are given. */
static inline dem2d_vec dem2di_from_frame(dem2d_vec normal, double n, double t) {
    return dem2di_along(dem2di_scale(normal, n), t, dem2di_perp(normal));
}

/* The contact point from A's centre. */
static inline dem2d_vec dem2di_arm_a(const dem2di_contact *contact) {
    return dem2di_from_frame(contact->normal, contact->arms.a_n, contact->arms.a_t);
}

/* The contact point from B's centre. */
static inline dem2d_vec dem2di_arm_b(const dem2di_contact *contact) {
    return dem2di_from_frame(contact->normal, contact->arms.b_n, contact->arms.b_t);
}

/* From A's centre to B's; to a wall: the contact point. */
static inline dem2d_vec dem2di_branch_of(const dem2di_contact *contact, bool wall) {
    const dem2di_arms *arms = &contact->arms;
    if (wall) return dem2di_arm_a(contact);
    return dem2di_from_frame(contact->normal, arms->a_n - arms->b_n, arms->a_t - arms->b_t);
}

/* Velocity of B against A at the contact point, along the tangent. */
static inline double dem2di_velocity_t(const dem2di_contact *contact,
                                       const dem2di_relative_motion *motion) {
    const dem2di_arms *arms = &contact->arms;
    return dem2di_cross(contact->normal, motion->v) -
           (arms->a_n * motion->wa - arms->b_n * motion->wb);
}

/* The same along the normal: below 0 the two approach. */
static inline double dem2di_velocity_n(const dem2di_contact *contact,
                                       const dem2di_relative_motion *motion) {
    const dem2di_arms *arms = &contact->arms;
    return dem2di_dot(contact->normal, motion->v) -
           (arms->b_t * motion->wb - arms->a_t * motion->wa);
}

/* Sliding velocity: mean over the step that was made, of what normal and arms were at its beginning
   and are at its end: those of the end alone leave an error of first order in the step. Of a new
   contact that of its end. One rule for all pairs: dem2di_batch_slip is the same for circles. */
static DEM2DI_INLINE double dem2di_slip(const dem2di_contact *last, const dem2di_contact *contact,
                                        const dem2di_relative_motion *motion) {
    double slip = dem2di_velocity_t(contact, motion);
    if (!(last->depth > 0)) return slip;
    return slip + (dem2di_velocity_t(last, motion) - slip) / 2;
}

/* Are there two? One of them may be without force: deep in a face it could only pull. */
static inline bool dem2di_has_two_points(const dem2di_point_pair *pair) {
    return pair->weight[0] > 0 || pair->weight[1] > 0;
}

/* The springs of the last step's points, handed on to those of this step. Each stays at its end of
   the common part, whichever shape's corner that is by now; where one end's corner is now that of
   the other end, both have changed sides, as a grain tips over it. A spring of one point is shared
   out by the forces of the normal springs, and one point has the sum of two. */
static void dem2di_point_pair_carry(const dem2di_contact *last, const dem2di_point_pair *last_pair,
                                    const dem2di_point_pair *pair, const double force[2],
                                    double shear[2]) {
    if (!dem2di_has_two_points(last_pair)) {
        double sum = force[0] + force[1]; /* 0 where it is too small to be a number */
        shear[1] = last->shear * (sum > 0 ? force[1] / sum : 0.5);
        shear[0] = last->shear - shear[1];
        return;
    }
    bool crossed =
        pair->corner[0] == last_pair->corner[1] || pair->corner[1] == last_pair->corner[0];
    shear[0] = last_pair->shear[crossed ? 1 : 0];
    shear[1] = last_pair->shear[crossed ? 0 : 1];
}

/* Normal, point (from A's centre) and depths of a contact of two points into the contact: those of
   the normal springs' resultant, whose moment is theirs. The normals are nearly parallel: as
   springs along the resultant both keep their parts of it. */
static dem2d_vec dem2di_point_pair_set(const dem2d_contact_point points[2], dem2di_point_pair *pair,
                                       dem2di_contact *contact) {
    dem2d_vec force[2], sum, u;
    double part[2], moment = 0;
    for (int i = 0; i < 2; i++) {
        part[i] = points[i].weight * points[i].depth;
        force[i] = dem2di_scale(points[i].normal, part[i]);
    }
    sum = dem2di_add(force[0], force[1]);
    if (dem2di_unit(sum, &u)) contact->normal = u;
    double total = dem2di_dot(sum, contact->normal), both = part[0] + part[1];
    dem2d_vec point = dem2di_along(points[0].position, part[1] / both,
                                   dem2di_sub(points[1].position, points[0].position));
    for (int i = 0; i < 2; i++)
        moment += dem2di_cross(dem2di_sub(points[i].position, point), force[i]);
    dem2d_vec t = dem2di_perp(contact->normal);
    point = dem2di_along(point, -moment / total, t);
    for (int i = 0; i < 2; i++) {
        pair->weight[i] = points[i].weight * (total / both);
        pair->depth[i] = points[i].depth;
        pair->corner[i] = points[i].corner;
        pair->offset[i] = dem2di_dot(dem2di_sub(points[i].position, point), t);
    }
    pair->energy = points[0].energy + points[1].energy;
    return point;
}

/* The contact point is moved along the tangent. */
static inline void dem2di_arms_shift(dem2di_arms *arms, double by) {
    arms->a_t += by;
    arms->b_t += by;
}

/* --- dashpot, rolling --------------------------------------------------------------------------
 */

/* Coefficient of the dashpot, N s/m. */
static double dem2di_dashpot(const dem2d_pair_desc *law, double mass) {
    return 2 * law->damping_ratio * sqrt(mass * law->normal_stiffness);
}

/* Stiffness of the spring against rolling. */
static double dem2di_rolling_stiffness(const dem2d_pair_desc *law, double radius) {
    return law->tangential_stiffness * radius * radius;
}

/* -ln e of a dashpot whose force is clipped: Schwager, Poeschel, Granular Matter 9 (2007) 465. */
static double dem2di_damping_loss(double zeta) {
    double away = sqrt(fabs(1 - zeta)) * sqrt(1 + zeta);
    dem2d_rot rotation = {zeta, away};
    if (!(away > 0)) return 2 * zeta; /* the limit of both */
    double angle = zeta < 1 ? dem2d_rot_angle(rotation) : dem2di_log_ratio(zeta + away, 1);
    return 2 * zeta * angle / away;
}

DEM2D_API dem2d_result dem2d_damping_ratio(double restitution, double *damping_ratio) {
    if (damping_ratio == NULL) return DEM2D_NULL_ARGUMENT;
    if (!dem2di_finite(restitution)) return DEM2D_NOT_FINITE;
    if (!(restitution > 0 && restitution <= 1)) return DEM2D_OUT_OF_RANGE;
    double loss = dem2di_log_ratio(1, restitution), low = 0, high = 1;
    while (dem2di_damping_loss(high) < loss) high *= 2; /* grows as the logarithm */
    for (double middle = high / 2; low < middle && middle < high; middle = low + (high - low) / 2)
        if (dem2di_damping_loss(middle) < loss)
            low = middle;
        else
            high = middle;
    *damping_ratio = loss > 0 ? high : 0;
    return DEM2D_OK;
}

/* --- the law over contact points in arrays -------------------------------------------------------
 */

/* So many contact points or pairs of circles go through the law at once: 6 kB of arrays, little of
   the innermost cache. */
#define DEM2DI_BATCH 32

/* Contact points of closed contacts on their way through the law; those of a contact of two are in
   two rows, one after the other. Of terms that are not in use nothing is written or read. */
typedef struct dem2di_law_rows {
    int count;
    int contact[DEM2DI_BATCH]; /* number in the list */
    /* geometry, and how the two moved in the step that was made */
    double depth[DEM2DI_BATCH], approach[DEM2DI_BATCH], sliding[DEM2DI_BATCH], spin[DEM2DI_BATCH];
    /* of the pair of materials, here: the part of the point, the reduced mass and radius are in */
    double stiffness[DEM2DI_BATCH], dashpot[DEM2DI_BATCH], friction[DEM2DI_BATCH];
    double tangential_stiffness[DEM2DI_BATCH], rolling_stiffness[DEM2DI_BATCH];
    double rolling_friction[DEM2DI_BATCH]; /* m: the limit of the moment over the normal force */
    /* forces on B: of the springs in the step before, then those of this step. The moment of two
       points is that of the first row */
    double last_shear[DEM2DI_BATCH], last_moment[DEM2DI_BATCH];
    double force[DEM2DI_BATCH], shear[DEM2DI_BATCH], moment[DEM2DI_BATCH];
    dem2di_two state[DEM2DI_BATCH]; /* what the caller's law keeps */
} dem2di_law_rows;

/* A force held within its limit. */
static DEM2DI_INLINE double dem2di_held(double limit, double force) {
    force = limit < force ? limit : force;
    return -limit > force ? -limit : force;
}

/* Normal force of a spring and the dashpot, clipped where it would pull. */
static DEM2DI_INLINE double dem2di_damped(double spring, double dashpot, double approach) {
    double force = spring + dashpot * approach;
    return 0 > force ? 0 : force;
}

/* Normal force and friction of one point, [F] eq. 8-10. The tangential spring is a scalar along
   perp(normal), so that it turns with the contact. */
static DEM2DI_INLINE void dem2di_law_points(dem2di_law_rows *rows, double time_step, bool damped) {
    for (int k = 0; k < rows->count; k++) {
        double force = rows->stiffness[k] * rows->depth[k];
        if (damped) force = dem2di_damped(force, rows->dashpot[k], rows->approach[k]);
        double shear =
            rows->last_shear[k] - rows->tangential_stiffness[k] * rows->sliding[k] * time_step;
        rows->force[k] = force;
        rows->shear[k] = dem2di_held(rows->friction[k] * force, shear);
    }
}

/* Moments of the springs against rolling, held within their limits (Ai et al. 2011, model C without
   the dashpot). The limit of two points is that of both normal forces. */
static void dem2di_law_rolling(dem2di_law_rows *rows, double time_step) {
    for (int k = 0; k < rows->count; k++) {
        bool two = k + 1 < rows->count && rows->contact[k + 1] == rows->contact[k];
        double force = two ? rows->force[k] + rows->force[k + 1] : rows->force[k];
        double moment =
            rows->last_moment[k] - rows->rolling_stiffness[k] * rows->spin[k] * time_step;
        rows->moment[k] = dem2di_held(rows->rolling_friction[k] * force, moment);
        if (two) rows->moment[++k] = 0;
    }
}

DEM2DI_VECTORS_BEGIN
static void dem2di_law_springs(dem2di_law_rows *rows, double time_step) {
    dem2di_law_points(rows, time_step, false);
}

static void dem2di_law_dashpots(dem2di_law_rows *rows, double time_step) {
    dem2di_law_points(rows, time_step, true);
}
DEM2DI_VECTORS_END

/* The law for all rows, with the terms that are in use. */
static void dem2di_law_solve(dem2di_law_rows *rows, double time_step, int terms) {
    if (terms & DEM2DI_DASHPOT)
        dem2di_law_dashpots(rows, time_step);
    else
        dem2di_law_springs(rows, time_step);
    if (terms & DEM2DI_ROLLING) dem2di_law_rolling(rows, time_step);
}

/* --- forces on the two -------------------------------------------------------------------------
 */

/* Force on B. */
static inline dem2d_vec dem2di_contact_force(const dem2di_contact *contact) {
    return dem2di_along(dem2di_scale(contact->normal, contact->force), contact->shear,
                        dem2di_perp(contact->normal));
}

/* Torque on A, and on B. */
static inline double dem2di_torque_a(const dem2di_contact *contact, double moment) {
    const dem2di_arms *arms = &contact->arms;
    return -(arms->a_n * contact->shear - arms->a_t * contact->force) - moment;
}

static inline double dem2di_torque_b(const dem2di_contact *contact, double moment) {
    const dem2di_arms *arms = &contact->arms;
    return arms->b_n * contact->shear - arms->b_t * contact->force + moment;
}

/* Force and torque of contacts on a particle. */
typedef struct dem2di_load {
    dem2d_vec force;
    double torque;
} dem2di_load;

/* Stiffness of one particle: the upper triangle of a symmetric matrix in x, y, angle. */
typedef struct dem2di_stiffness {
    double xx, xy, yy, xr, yr, rr;
} dem2di_stiffness;

/* K += k b b^T for the direction u, which has the lever r about the centre. */
static void dem2di_stiffness_add(dem2di_stiffness *k, double stiffness, dem2d_vec u, double r) {
    k->xx += stiffness * u.x * u.x;
    k->xy += stiffness * u.x * u.y;
    k->yy += stiffness * u.y * u.y;
    k->xr += stiffness * u.x * r;
    k->yr += stiffness * u.y * r;
    k->rr += stiffness * r * r;
}

/* Largest eigenvalue of M^-1 K: of the symmetric M^-1/2 K M^-1/2. All roots of its characteristic
   polynomial are real and not negative, so Newton's iteration from their sum falls on the largest
   monotonically. */
static double dem2di_largest_eigenvalue(const dem2di_stiffness *k, double mass, double inertia) {
    double a = k->xx / mass, b = k->yy / mass, c = k->rr / inertia, trace = a + b + c;
    double cross = 1 / (sqrt(mass) * sqrt(inertia) * trace); /* scaled to a trace of 1 */
    double d = k->xy / mass / trace, e = k->xr * cross, f = k->yr * cross;
    a /= trace, b /= trace, c /= trace;
    double p2 = a + b + c, p1 = a * b + b * c + c * a - d * d - e * e - f * f;
    double p0 = a * b * c + 2 * d * e * f - a * f * f - b * e * e - c * d * d;
    double x = p2;
    for (int i = 0; i < 60; i++) { /* a triple root halves the error by 1/3 each time */
        double value = ((x - p2) * x + p1) * x - p0, slope = (3 * x - 2 * p2) * x + p1;
        if (!(slope > 0) || value <= 0) break;
        double next = x - value / slope;
        if (!(next < x)) break;
        x = next;
    }
    return x * trace;
}

/* ============================================================================================
   >>motion  Leapfrog: velocities at half steps, rotations without trigonometry
   uses: config, math
   ============================================================================================ */

/* What moves of a particle (q: see dem2di_orientation), with the radius of its bounding circle: all
   that a look at a pair of circles needs is in one line of a cache. */
typedef struct dem2di_state {
    dem2d_vec x;
    dem2d_rot q;
    dem2d_vec v;
    double w;
    double radius;
} dem2di_state;

typedef struct dem2di_damping {
    double local;         /* Cundall's factor */
    double keep, receive; /* global: v <- keep v + receive F/m */
} dem2di_damping;

static dem2di_damping dem2di_damping_make(double local, double global, double time_step) {
    dem2di_damping damping;
    double half = global * time_step / 2;
    damping.local = local;
    damping.keep = (1 - half) / (1 + half);
    damping.receive = time_step / (1 + half);
    return damping;
}

/* New velocity component under an acceleration: the drag is against the velocity, and none at rest.
 */
static inline double dem2di_accelerate(const dem2di_damping *damping, double v,
                                       double acceleration) {
    double drag = v != 0 ? damping->local * fabs(acceleration) : 0;
    return damping->keep * v + damping->receive * (acceleration - copysign(drag, v));
}

/* q turned by an angle: t = tan(angle/2) = x (1 + x^2/3) with x = angle/2 to fourth order, and the
   rational rotation of it; below t^2 = 2^-17 the third power of t^2 is nothing. One Newton step of
   1/|q| keeps the length at 1 to rounding; it is that of the old q, so as not to wait for the new.
 */
static inline dem2d_rot dem2di_rotate(dem2d_rot q, double angle) {
    double x = angle / 2, t = x * (1 + x * x * (1.0 / 3)), square = t * t;
    double f = square < 1.0 / 131072 ? 1 - square * (1 - square) : 1 / (1 + square);
    double c = 1 - square, s = 2 * t;
    dem2d_rot r;
    f *= 1.5 - (q.c * q.c + q.s * q.s) / 2;
    r.c = (q.c * c - q.s * s) * f;
    r.s = (q.s * c + q.c * s) * f;
    return r;
}

/* An angle turned further, about once around at most. */
static inline double dem2di_turned(double angle, double by) {
    angle += by;
    return fabs(angle) > DEM2DI_PI ? fmod(angle, 2 * DEM2DI_PI) : angle;
}

/* Bound of how far a point of the support moves with a particle in a step: its path, by the
   octagon around the circle, and the turn times the greatest lever; rounded up. tan of half the
   angle, as dem2di_rotate takes it, is above half the angle. */
static inline double dem2di_displaced(const dem2di_state *state, double lever, double time_step,
                                      double before) {
    double x = fabs(state->v.x), y = fabs(state->v.y), turn = fabs(state->w) * time_step / 2;
    double path = dem2di_max(x, y) + 0.41421356237309515 * dem2di_min(x, y);
    double step = path * time_step + lever * (2 * turn * (1 + turn * turn * (1.0 / 3)));
    return before + (step + before * (2 * DBL_EPSILON));
}

static bool dem2di_state_finite(const dem2di_state *state) {
    return dem2di_vec_finite(state->x) && dem2di_vec_finite(state->v) && dem2di_finite(state->w) &&
           dem2di_finite(state->q.c) && dem2di_finite(state->q.s);
}

/* ============================================================================================
   >>world  What a world holds: structs, and tables of their fields and of the columns
   uses: config, memory, fields, support, broad, law, motion
   ============================================================================================ */

/* HOW THE DATA LIVE AND FLOW

   Bodies (particles, by slots; walls) have states at the last force pass (before), now, and those
   of the next step, which come over before. Walls have parts, which move with them. Pairs are near
   each other: the list has their keys, sorted by kind (circles, others, walls), and where the
   contacts of each particle are. A contact is what the last force pass found of a pair and what the
   next step starts from. Each of these is a column, an array with one line in the table
   dem2di_columns.

   Passes of a step, each in a function that changes only what it is named for:
     list       positions -> keys, contacts carried over, adjacency; only when the list is used up
     force      positions, velocities, last contacts, laws -> next contacts over the last, loads.
                Of each pair first the geometry (collide), then the law; kernels of circles do both.
                Where segments are joined, it is decided in between which contacts count (resolve)
     gather     loads -> force and torque of each particle, in the order of its partners' ranks:
               part of integrate, unless a callback may change the sums; external loads are added
     control    forces on servo walls, next states of their particles -> velocities of walls
     check      contacts, loads -> may the step be taken? The last pass that may refuse it
     integrate  states, forces -> next states
     observe    last and next contacts, states -> ledger: only reads the others' results
     commit     the next states become those of now

   Invariants between steps, which tests/inside.h checks:
     1. Ids and slots of particles lead to each other. Slots that are free have a shape of -1.
     2. A key is of two particles that live, the one of lower rank first, or of a particle that
   lives and a part of a wall; or it is forgotten (a < 0), its contact is apart, the list is stale.
     3. A contact is closed where its depth is above 0. Otherwise it has no force, points or law
        state. Two circles that are both of the disc kind have their arms from the depth.
     4. adjacent has each contact of a listed pair once for each of its particles, first as B.
     5. before is where the last force pass was, with the contacts that it found: queries, the
        writers and the hash read these and compute nothing anew.
     6. The parts of walls are in the order of the walls' ranks, free slots have none; surfaces are
        where the walls' states of now put them.
     7. Loads, list.last, and all else in scratch are valid during a step only, but for the zeros of
        contacts that are apart.
   Results depend on positions, velocities, laws, and the history of each contact since it closed;
   not on which pairs are listed, the order in memory, or how work is shared out. */

typedef struct dem2di_template {
    dem2d_shape *shape; /* NULL: free slot */
    uint32_t generation;
    int users;
} dem2di_template;

/* What does not change while a particle lives, but for its motion and its rank. */
typedef struct dem2di_body {
    double scale;
    int shape_index; /* of the template; -1: removed, until the slots are put in order */
    int index;       /* of the particle's id */
    int rank;        /* orders pairs and sums: the index, or place in the order of names */
    uint16_t material;
    uint8_t motion;  /* dem2d_motion */
    bool redirected; /* has been given other velocities since the last step */
} dem2di_body;

/* What turns force and torque into accelerations: 0 of all that is not free. */
typedef struct dem2di_inverse {
    double mass, inertia;
} dem2di_inverse;

/* Velocities of a particle. */
typedef struct dem2di_velocities {
    dem2d_vec v;
    double w;
} dem2di_velocities;

static dem2di_velocities dem2di_velocities_of(const dem2di_state *state) {
    dem2di_velocities velocities;
    velocities.v = state->v;
    velocities.w = state->w;
    return velocities;
}

/* A row of the id table: the slot of a particle, or where the next free id is: -2 - index, -1 at
   the end. */
typedef struct dem2di_id_slot {
    int slot;
    uint32_t generation;
} dem2di_id_slot;

/* A row of the order of names: the id at this place, and the place of the id of this index. */
typedef struct dem2di_ranked {
    int index, rank;
} dem2di_ranked;

/* A wall as described. */
typedef struct dem2di_wall {
    dem2d_wall_desc desc; /* normal of unit length */
    int span[2];          /* indices, or -1 */
    int first, count;     /* its parts; a free slot has none */
    dem2d_vec listed[3];  /* point, end (segments) and normal when the list was built */
    bool reshaped;        /* has been turned, or become longer or shorter, since */
    double skin;          /* how far it may move before the next time */
    uint32_t generation;
    int users; /* walls that span to it */
    bool alive;
    int rank;   /* place in the order of the walls' names and indices */
    int placed; /* the wall at the place of this one's index */
} dem2di_wall;

/* What collides of a wall: a half-plane or a segment. The parts of all walls are in one array, in
   the order of the walls' ranks, so that sums go by the numbers of parts. */
typedef struct dem2di_part {
    dem2d_vec start; /* m, from the wall's point: of a segment the start, else on the surface */
    dem2d_rot along; /* direction of the surface, whose normal is to the left */
    double extent;   /* m, length of a segment; 0 of a half-plane */
    int wall;
} dem2di_part;

/* Where the surface of a part is: start and along in the plane. Follows from the wall's state. */
typedef struct dem2di_surface {
    dem2d_vec point;
    dem2d_rot along;
} dem2di_surface;

/* What a servo wall pushes against: sums over its closed contacts. */
typedef struct dem2di_backing {
    double stiffness; /* N/m, of the springs */
    double impedance; /* N s/m: how the forces of the next pass rise with the wall's speed */
    double mass;      /* kg/m, of the free particles */
} dem2di_backing;

typedef struct dem2di_wall_state {
    dem2d_vec point, velocity;
    dem2d_vec force;        /* of the particles on it */
    double drift;           /* servo: mean speed along the normal that holds the force, */
    dem2di_backing backing; /* and what there was at the last contact */
} dem2di_wall_state;

/* A contact of a servo wall in the next force pass: it presses with force + rise V, not below 0,
   when the wall's speed is V; the part `along` of this is against the wall's normal. */
typedef struct dem2di_push {
    double force, rise, along;
} dem2di_push;

/* Contacts in columns, one element for each pair of the list. */
typedef struct dem2di_contacts {
    double *normal_x, *normal_y, *depth, *force, *shear;
    dem2di_arms *arms;              /* all but circles: of contact i at i - discs */
    dem2di_history *history;        /* likewise */
    dem2di_point_pair *point_pairs; /* likewise, where contacts may have two points */
    /* of all contacts, where their terms of the law are in use: */
    double *moment;            /* on B, N */
    double *energy;            /* J/m, of the caller's law, */
    dem2di_two *state;         /* and what it keeps */
    dem2di_two *point_viscous; /* as point_pairs: parts of normal forces that dashpots have */
} dem2di_contacts;

/* The listed pairs: of two circles, of two other particles, of particles and parts of walls (in the
   order of the part, then of the particle's rank), and their contacts as the last force pass left
   them. */
typedef struct dem2di_list {
    dem2di_key *keys;         /* count; a < 0 when the contact was forgotten: it is apart */
    int discs, pairs, count;  /* where the kinds end */
    dem2di_contacts contacts; /* at the last force pass; a force pass writes the next over them */
    dem2di_contacts last;     /* what they were before a step that looks back: in scratch */
    int *adjacent; /* the contacts of each particle by the partner's rank, walls last: first those
                      of which it is B, as A has the lower rank, then as A */
    int *first;    /* of a slot's in adjacent; bodies + 1 */
    int *own;      /* of a slot's as A */
} dem2di_list;

/* What queries of space search, made by the first of them: see the section on queries. */
typedef struct dem2di_tree {
    bool made; /* of the particles as they are now */
    int count, levels, leaves;
    dem2d_box *boxes;            /* of nodes: 2 leaves - 1 */
    int *items;                  /* slots of particles, -1 - k for part k, leaf by leaf */
    dem2di_order *found, *spare; /* what a query finds, and room to sort it */
} dem2di_tree;

/* What the contact passes count. */
typedef struct dem2di_count {
    int64_t calls, collisions, separations, proofs[DEM2D_PROOF_COUNT];
    int64_t unsound; /* forces that are not finite */
    double load;     /* greatest of this pass, while nothing else bounds the states */
} dem2di_count;

/* The greatest eigenvalues of M_i^-1 sum_c f_c K_c, for the limit of the time step and for the safe
   bound, and the slots of their particles, or -1. */
typedef struct dem2di_stiffest {
    double value[2];
    int at[2];
} dem2di_stiffest;

/* What one block of parallel work found. */
typedef struct dem2di_block_result {
    dem2di_count count;
    dem2di_stiffest stiffest;
    double most;    /* greatest reach of the discs; greatest square of speed over skin */
    int fast;       /* slot of the one of least rank that may pass through others, or -1 */
    int64_t spread; /* sum of the distances in memory of the partners found */
} dem2di_block_result;

/* The features in use: decided after an edit, not per contact. See dem2di_prepare. */
typedef struct dem2di_plan {
    bool friction; /* some law between the materials in use has it */
    bool spin;     /* something turns, or may be turned */
    bool turns;    /* some particle is no circle: rotations matter, and pairs are skipped by
                      displacements */
    bool one_law;  /* all particles are of one material: */
    int material;
    bool held;                 /* some particles are not free */
    bool joints;               /* two segments meet, or may */
    int terms;                 /* DEM2DI_DASHPOT ...: of the law, beside springs and friction */
    int terms_now, terms_made; /* those that the laws have now, and had in the last force pass */
    bool faces;         /* contacts may have two points: by the rule, and some particle has faces */
    bool heavy, damped; /* gravity, damping: as they are set at the step */
} dem2di_plan;

/* Values that may be set without a look at the bounds of the motion: speeds and gravity, and angles
   turned in a step. */
#define DEM2DI_SPEED_SURE 1e30
#define DEM2DI_TURN_SURE 1e30

/* A list lasts at most so many steps. */
#define DEM2DI_LIST_STEPS (1 << 20)

/* At least the length of a vector. */
static double dem2di_size_of(dem2d_vec v) {
    return fabs(v.x) + fabs(v.y);
}

/* Of the pair list before anything is known of the motion: skin in radii, steps between two
   lists. */
#define DEM2DI_SKIN_FIRST 0.1
#define DEM2DI_INTERVAL_FIRST 100

#define DEM2DI_LINE \
    64 /* bytes: of a cache line, so that parts of scratch memory do not share one */

/* Accounts of the ledger; the first are work at a velocity, half of a step's before the positions
   and half behind. */
enum {
    DEM2DI_GRAVITY,
    DEM2DI_BY_LOADS,
    DEM2DI_BY_WALLS,
    DEM2DI_DRIVING,
    DEM2DI_BY_DAMPING,
    DEM2DI_HALVES,
    DEM2DI_BY_FRICTION = DEM2DI_HALVES,
    DEM2DI_BY_DASHPOTS,
    DEM2DI_ACCOUNTS
};

/* Energy stored in springs. */
typedef struct dem2di_stored {
    double normal, tangential, rolling;
} dem2di_stored;

typedef struct dem2di_ledger {
    bool kept;
    bool edited; /* the caller has changed something since the last step */
    double sum[DEM2DI_ACCOUNTS], half[DEM2DI_HALVES];
    double kinetic, given, closure, turnover;
    dem2di_stored stored;
} dem2di_ledger;

#define DEM2DI_MATERIALS_MAX 256 /* as declared: so many squared are the pairs of laws */

/* Columns of one length. Those before the keys grow one by one; the others are renewed with the
   list, and in large scenes are most of the memory. */
typedef enum dem2di_group {
    DEM2DI_WORLD, /* one row: the world itself */
    DEM2DI_TEMPLATES,
    DEM2DI_MATERIALS,
    DEM2DI_LAWS, /* laws_side squared */
    DEM2DI_IDS,
    DEM2DI_RANKS, /* of ids, where named */
    DEM2DI_BODIES,
    DEM2DI_NAMES,         /* of bodies, where named */
    DEM2DI_LOADS,         /* of bodies, where loaded */
    DEM2DI_DISPLACEMENTS, /* of bodies, where plan.turns */
    DEM2DI_MADE,          /* of bodies, where some are redirected */
    DEM2DI_SUMS,          /* of bodies, where the caller may change them */
    DEM2DI_EXCHANGED,     /* of ids, where the caller may change the sums */
    DEM2DI_WALLS_EXCHANGED,
    DEM2DI_STARTS, /* of the contacts of bodies, and the end of the last */
    DEM2DI_WALLS,
    DEM2DI_PARTS,
    DEM2DI_KEYS,
    DEM2DI_MOMENTS,       /* of all contacts, where plan.terms has DEM2DI_ROLLING, */
    DEM2DI_CALLERS,       /* or DEM2DI_CALLERS_LAW */
    DEM2DI_GENERAL,       /* of all but circles */
    DEM2DI_POINT_PAIRS,   /* of these, where plan.faces, */
    DEM2DI_POINT_VISCOUS, /* and plan.terms has DEM2DI_DASHPOT */
    DEM2DI_ADJACENCY,
    DEM2DI_BLOCK_RESULTS,
    DEM2DI_TREE,    /* particles and walls, where queries are asked; as many nodes are enough */
    DEM2DI_SCRATCH, /* lines */
    DEM2DI_SHAPE,   /* one row: a shape itself; its columns by its count, its parts, ... */
    DEM2DI_SHAPE_COUNT,
    DEM2DI_SHAPE_PARTS,
    DEM2DI_SHAPE_BLOCKS,
    DEM2DI_SHAPE_SECTORS,
    DEM2DI_GROUPS
} dem2di_group;

struct dem2d_world {
    dem2d_env user_env, env; /* the caller's, and the one that counts bytes */
    size_t bytes;
    dem2d_law_fn *law;
    void *law_user;
    int law_tag;
    bool has_law; /* law is not NULL: for snapshots, which can't have the function */
    dem2d_parallel_fn *parallel_for;
    void *parallel_user;
    dem2d_gather_fn *gather;
    dem2d_commit_fn *commit;
    void *exchange_user; /* of both */
    dem2d_loads_fn *set_loads;
    void *loads_user;
    bool stepping; /* a step is on its way: callbacks can't start another */
    double time_step, local_damping, global_damping, tolerance;
    double made_step; /* time step of the step that was made; before the first as time_step */
    dem2d_vec gravity;
    int max_iterations;
    dem2d_solver solver;
    dem2d_face_rule faces;

    bool keeps_last; /* the force pass keeps the contacts of the last one */
    bool check_time_step;
    bool check_due;    /* an edit since the last check of the time step and the speeds can matter */
    int plan_due;      /* steps for which the features in use are found anew, see dem2di_prepare */
    bool immovable;    /* some listed pair is: see dem2di_immovable */
    bool list_stale;   /* the list must be built before the next force pass */
    bool list_used_up; /* because something has left its skin */
    bool skin_fixed;   /* as the caller wants it */
    bool scattered;    /* particles that meet are far from each other in memory */
    double skin;       /* of the radius */
    double interval;   /* steps that a list is expected to last */
    double list_displacement;     /* part of the skins used up since the list was built */
    double roundoff_displacement; /* part of a skin that the rounding of a position may use up in a
                                     step */
    double rounding;              /* m, of a position */
    dem2d_box box;                /* holds all centres while the list lasts */
    bool bounded;                 /* no state can become infinite while the list lasts */
    double softness; /* of the list: times the stiffness of a contact it bounds all eigenvalues */
    double spread;   /* mean distance in memory of two partners when last sorted */
    int64_t steps, rebuilds, slow_time_step, fast_motion, listed_at;
    int64_t timed_at; /* steps when the time step was last changed */
    double timed;     /* s, the time then: one product adds the rest, with one rounding */
    dem2di_count count;
    dem2di_plan plan;
    dem2di_ledger ledger;

    dem2di_template *templates;
    dem2d_material_desc *materials;
    dem2d_pair_desc *laws; /* laws_side squared */
    int template_count, material_count, laws_side;

    int body_count; /* slots in use, holes too */
    int holes, id_count, free_id;
    dem2di_id_slot *ids;  /* by the index of an id */
    bool named;           /* a particle has had a name: the next two are there */
    bool order_due;       /* particles have come since the order of names was found */
    dem2di_ranked *order; /* all ids, free ones too */
    uint64_t *names;
    dem2di_state *before, *now; /* at the last force pass, present; the next come over before */
    dem2di_body *bodies;
    dem2di_inverse *inverse;
    double *inverse_skin_squared; /* 1 / skin^2: the list holds until some path is as long as its
                                     skin */
    double *displacement, *next_displacement; /* since the list was built, see dem2di_displaced */
    double *lever;           /* a support value changes by at most this times the angle of a turn */
    dem2di_velocities *made; /* of the redirected: velocities in the step that was made */
    bool redirected;         /* some particles are */

    dem2d_shape *line; /* a polygon of two corners, of length 1: what segments are, scaled */
    dem2di_wall *walls;
    dem2di_wall_state *wall_before, *wall_now, *wall_next;
    dem2di_part *parts;
    dem2di_surface *surfaces; /* of the parts now */
    int wall_count, part_count;

    dem2di_list list;
    double *load_x, *load_y; /* force on the B of each contact, on A against it; in scratch, as: */
    double *load_a, *load_b; /* torques on A and on B */
    bool loaded, twisted;    /* a particle has had an external load; one that is a torque: */
    dem2di_load *loads;      /* of all */
    dem2di_load *sums;       /* of the forces on each particle, where the caller may change them */
    dem2d_sums exchange;     /* the same and those on walls for a caller, by ids */
    dem2di_push *pushes;     /* room for the contacts of a servo wall */
    char *scratch;           /* what only a step or only the building of the list needs */
    dem2di_tree tree;
    dem2di_block_result *block_results;

    int capacity[DEM2DI_GROUPS]; /* elements that the columns of a group have room for */
};

/* The world's own environment counts what is in use and hands on to the caller's. */
static void *dem2di_world_allocate(void *user, size_t size) {
    dem2d_world *world = (dem2d_world *)user;
    void *memory = dem2di_allocate(&world->user_env, 1, size);
    if (memory != NULL) world->bytes += size;
    return memory;
}

static void dem2di_world_release(void *user, void *memory, size_t size) {
    dem2d_world *world = (dem2d_world *)user;
    world->bytes -= size;
    dem2di_release(&world->user_env, memory, 1, size);
}

static void dem2di_world_log(void *user, dem2d_result result, int index, const char *text) {
    dem2d_world *world = (dem2d_world *)user;
    if (world->user_env.log != NULL) world->user_env.log(world->user_env.user, result, index, text);
}

static const dem2di_field dem2di_material_fields[] = {
    DEM2DI_ROW(dem2d_material_desc, density, DEM2DI_POSITIVE, "kg/m2 none; walls ignore it"),
    DEM2DI_ROW(dem2d_material_desc, normal_stiffness, DEM2DI_POSITIVE, "N/m none"),
    DEM2DI_ROW(dem2d_material_desc, tangential_stiffness, DEM2DI_FROM_0, "N/m 0"),
    DEM2DI_ROW(dem2d_material_desc, friction, DEM2DI_FROM_0, "- 0"),
    DEM2DI_ROW(dem2d_material_desc, damping_ratio, DEM2DI_FROM_0, "- 0"),
    DEM2DI_ROW(dem2d_material_desc, rolling_friction, DEM2DI_FROM_0, "- 0"),
};

static const dem2di_field dem2di_pair_fields[] = {
    DEM2DI_ROW(dem2d_pair_desc, normal_stiffness, DEM2DI_POSITIVE, "N/m none"),
    DEM2DI_ROW(dem2d_pair_desc, tangential_stiffness, DEM2DI_FROM_0, "N/m 0"),
    DEM2DI_ROW(dem2d_pair_desc, friction, DEM2DI_FROM_0, "- 0"),
    DEM2DI_ROW(dem2d_pair_desc, damping_ratio, DEM2DI_FROM_0, "- 0"),
    DEM2DI_ROW(dem2d_pair_desc, rolling_friction, DEM2DI_FROM_0, "- 0"),
};

static const dem2di_field dem2di_wall_fields[] = {
    DEM2DI_ROW(dem2d_wall_desc, length, DEM2DI_FROM_0, "m none; of a servo > 0 or spans"),
    DEM2DI_ROW(dem2d_wall_desc, mode, DEM2DI_CHOICE(DEM2D_WALL_SERVO + 1), "- STILL"),
    DEM2DI_ROW(dem2d_wall_desc, material, DEM2DI_HANDLE, "- none; a material of this world"),
    DEM2DI_ROW(dem2d_wall_desc, point, DEM2DI_VECTOR, "m 0"),
    DEM2DI_ROW(dem2d_wall_desc, normal, DEM2DI_VECTOR, "- none; not zero; normalised"),
    DEM2DI_ROW(dem2d_wall_desc, segment, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_wall_desc, end, DEM2DI_VECTOR, "m 0; of segments not point"),
    DEM2DI_ROW(dem2d_wall_desc, velocity, DEM2DI_VECTOR, "m/s 0; MOVING only"),
    DEM2DI_ROW(dem2d_wall_desc, stress, DEM2DI_FINITE, "Pa 0; SERVO only"),
    DEM2DI_ROW(dem2d_wall_desc, max_speed, DEM2DI_FROM_0, "m/s none; > 0 for SERVO"),
    DEM2DI_ROW(dem2d_wall_desc, spans, DEM2DI_HANDLE, "- none; two walls, or both zero"),
    DEM2DI_ROW(dem2d_wall_desc, name, DEM2DI_WORD, "- 0"),
};

/* --- columns ------------------------------------------------------------------------------------
   Each array of the world is a column: one line of dem2di_columns says what is done with it. Tables
   of fields say what numbers there are in the columns that are saved. */

#define DEM2DI_SAVED(name, of, field, range) \
    { name, range, sizeof(((of *)0)->field), offsetof(of, field) DEM2DI_FIELD_TEXT("") }
/* Columns of plain numbers. */
#define DEM2DI_PLAIN(name, type, range) \
    { name, range, sizeof(type), 0 DEM2DI_FIELD_TEXT("") }

static const dem2di_field dem2di_setting_fields[] = {
    DEM2DI_SAVED("time_step", dem2d_world, time_step, DEM2DI_POSITIVE),
    DEM2DI_SAVED("made_step", dem2d_world, made_step, DEM2DI_POSITIVE),
    DEM2DI_SAVED("gravity", dem2d_world, gravity, DEM2DI_VECTOR),
    DEM2DI_SAVED("local_damping", dem2d_world, local_damping, DEM2DI_FRACTION),
    DEM2DI_SAVED("global_damping", dem2d_world, global_damping, DEM2DI_FROM_0),
    DEM2DI_SAVED("contact_tolerance", dem2d_world, tolerance, DEM2DI_POSITIVE),
    DEM2DI_SAVED("max_iterations", dem2d_world, max_iterations, DEM2DI_WHOLE(1, 1 << 30)),
    DEM2DI_SAVED("solver", dem2d_world, solver, DEM2DI_CHOICE(DEM2D_SOLVER_COUNT)),
    DEM2DI_SAVED("faces", dem2d_world, faces, DEM2DI_CHOICE(DEM2D_FACE_RULE_COUNT)),
    DEM2DI_SAVED("check_time_step", dem2d_world, check_time_step, DEM2DI_SWITCH),
    DEM2DI_SAVED("steps", dem2d_world, steps, DEM2DI_COUNTER),
    DEM2DI_SAVED("timed_at", dem2d_world, timed_at, DEM2DI_COUNTER),
    DEM2DI_SAVED("timed", dem2d_world, timed, DEM2DI_ANY_NUMBER)}; /* a sum, which may overflow */

/* What of the list outlives it, counters, lengths. */
static const dem2di_field dem2di_progress_fields[] = {
    DEM2DI_SAVED("has_law", dem2d_world, has_law, DEM2DI_SWITCH),
    DEM2DI_SAVED("law_tag", dem2d_world, law_tag, DEM2DI_TAG),
    DEM2DI_SAVED("redirected", dem2d_world, redirected, DEM2DI_SWITCH),
    DEM2DI_SAVED("named", dem2d_world, named, DEM2DI_SWITCH),
    DEM2DI_SAVED("loaded", dem2d_world, loaded, DEM2DI_SWITCH),
    DEM2DI_SAVED("order_due", dem2d_world, order_due, DEM2DI_SWITCH),
    DEM2DI_SAVED("list_stale", dem2d_world, list_stale, DEM2DI_SWITCH),
    DEM2DI_SAVED("list_used_up", dem2d_world, list_used_up, DEM2DI_SWITCH),
    DEM2DI_SAVED("check_due", dem2d_world, check_due, DEM2DI_SWITCH),
    DEM2DI_SAVED("plan_due", dem2d_world, plan_due, DEM2DI_WHOLE(0, 2)),
    DEM2DI_SAVED("skin_fixed", dem2d_world, skin_fixed, DEM2DI_SWITCH),
    DEM2DI_SAVED("scattered", dem2d_world, scattered, DEM2DI_SWITCH),
    DEM2DI_SAVED("bounded", dem2d_world, bounded, DEM2DI_SWITCH),
    DEM2DI_SAVED("softness", dem2d_world, softness, DEM2DI_MAY_OVERFLOW),
    DEM2DI_SAVED("skin", dem2d_world, skin, DEM2DI_POSITIVE),
    DEM2DI_SAVED("interval", dem2d_world, interval, DEM2DI_FROM_0),
    DEM2DI_SAVED("spread", dem2d_world, spread, DEM2DI_FROM_0),
    DEM2DI_SAVED("list_displacement", dem2d_world, list_displacement, DEM2DI_ANY_NUMBER),
    DEM2DI_SAVED("rounding_displacement", dem2d_world, roundoff_displacement, DEM2DI_ANY_NUMBER),
    DEM2DI_SAVED("rounding", dem2d_world, rounding, DEM2DI_ANY_NUMBER),
    DEM2DI_SAVED("lower", dem2d_world, box.lower, DEM2DI_ANY_NUMBER),
    DEM2DI_SAVED("upper", dem2d_world, box.upper, DEM2DI_ANY_NUMBER),
    DEM2DI_SAVED("listed_at", dem2d_world, listed_at, DEM2DI_COUNTER),
    DEM2DI_SAVED("list_rebuilds", dem2d_world, rebuilds, DEM2DI_COUNTER),
    DEM2DI_SAVED("slow_time_step", dem2d_world, slow_time_step, DEM2DI_COUNTER),
    DEM2DI_SAVED("fast_motion", dem2d_world, fast_motion, DEM2DI_COUNTER),
    DEM2DI_SAVED("support_evaluations", dem2d_world, count.calls, DEM2DI_COUNTER),
    DEM2DI_SAVED("collisions", dem2d_world, count.collisions, DEM2DI_COUNTER),
    DEM2DI_SAVED("separations", dem2d_world, count.separations, DEM2DI_COUNTER),
    DEM2DI_SAVED("unsound", dem2d_world, count.unsound, DEM2DI_COUNTER),
    DEM2DI_SAVED("proofs", dem2d_world, count.proofs, DEM2DI_COUNTER),
    DEM2DI_SAVED("shapes", dem2d_world, template_count, DEM2DI_WHOLE(0, 1 << 30)),
    DEM2DI_SAVED("materials", dem2d_world, material_count, DEM2DI_WHOLE(0, DEM2DI_MATERIALS_MAX)),
    DEM2DI_SAVED("ids", dem2d_world, id_count, DEM2DI_WHOLE(0, 1 << 30)),
    DEM2DI_SAVED("free_id", dem2d_world, free_id, DEM2DI_WHOLE(-1, 1 << 30)),
    DEM2DI_SAVED("particles", dem2d_world, body_count, DEM2DI_WHOLE(0, 1 << 30)),
    DEM2DI_SAVED("walls", dem2d_world, wall_count, DEM2DI_WHOLE(0, 1 << 30)),
    DEM2DI_SAVED("wall_parts", dem2d_world, part_count, DEM2DI_WHOLE(0, 1 << 30)),
    DEM2DI_SAVED("disc_pairs", dem2d_world, list.discs, DEM2DI_WHOLE(0, 1 << 30)),
    DEM2DI_SAVED("pairs", dem2d_world, list.pairs, DEM2DI_WHOLE(0, 1 << 30)),
    DEM2DI_SAVED("contacts", dem2d_world, list.count, DEM2DI_WHOLE(0, 1 << 30))};

/* Gravity and damping are looked at in each step. */
static const dem2di_field dem2di_plan_fields[] = {
    DEM2DI_SAVED("friction", dem2d_world, plan.friction, DEM2DI_SWITCH),
    DEM2DI_SAVED("spin", dem2d_world, plan.spin, DEM2DI_SWITCH),
    DEM2DI_SAVED("turns", dem2d_world, plan.turns, DEM2DI_SWITCH),
    DEM2DI_SAVED("one_law", dem2d_world, plan.one_law, DEM2DI_SWITCH),
    DEM2DI_SAVED("material", dem2d_world, plan.material, DEM2DI_WHOLE(0, DEM2DI_MATERIALS_MAX)),
    DEM2DI_SAVED("held", dem2d_world, plan.held, DEM2DI_SWITCH),
    DEM2DI_SAVED("joints", dem2d_world, plan.joints, DEM2DI_SWITCH),
    DEM2DI_SAVED("terms", dem2d_world, plan.terms, DEM2DI_WHOLE(0, DEM2DI_TERMS - 1)),
    DEM2DI_SAVED("terms_now", dem2d_world, plan.terms_now, DEM2DI_WHOLE(0, DEM2DI_TERMS - 1)),
    DEM2DI_SAVED("terms_made", dem2d_world, plan.terms_made, DEM2DI_WHOLE(0, DEM2DI_TERMS - 1)),
    DEM2DI_SAVED("faces", dem2d_world, plan.faces, DEM2DI_SWITCH)};

#define DEM2DI_ACCOUNT(name, place) DEM2DI_SAVED(name, dem2d_world, ledger.place, DEM2DI_ANY_NUMBER)

static const dem2di_field dem2di_ledger_fields[] = {
    DEM2DI_SAVED("kept", dem2d_world, ledger.kept, DEM2DI_SWITCH),
    DEM2DI_SAVED("edited", dem2d_world, ledger.edited, DEM2DI_SWITCH),
    DEM2DI_ACCOUNT("gravity", sum[DEM2DI_GRAVITY]),
    DEM2DI_ACCOUNT("half_gravity", half[DEM2DI_GRAVITY]),
    DEM2DI_ACCOUNT("loads", sum[DEM2DI_BY_LOADS]),
    DEM2DI_ACCOUNT("half_loads", half[DEM2DI_BY_LOADS]),
    DEM2DI_ACCOUNT("walls", sum[DEM2DI_BY_WALLS]),
    DEM2DI_ACCOUNT("half_walls", half[DEM2DI_BY_WALLS]),
    DEM2DI_ACCOUNT("driving", sum[DEM2DI_DRIVING]),
    DEM2DI_ACCOUNT("half_driving", half[DEM2DI_DRIVING]),
    DEM2DI_ACCOUNT("damping", sum[DEM2DI_BY_DAMPING]),
    DEM2DI_ACCOUNT("half_damping", half[DEM2DI_BY_DAMPING]),
    DEM2DI_ACCOUNT("friction", sum[DEM2DI_BY_FRICTION]),
    DEM2DI_ACCOUNT("dashpots", sum[DEM2DI_BY_DASHPOTS]),
    DEM2DI_ACCOUNT("kinetic", kinetic),
    DEM2DI_ACCOUNT("given", given),
    DEM2DI_ACCOUNT("closure", closure),
    DEM2DI_ACCOUNT("turnover", turnover),
    DEM2DI_ACCOUNT("normal", stored.normal),
    DEM2DI_ACCOUNT("tangential", stored.tangential),
    DEM2DI_ACCOUNT("rolling", stored.rolling)};

static const dem2di_field dem2di_template_fields[] = {
    DEM2DI_SAVED("generation", dem2di_template, generation, DEM2DI_HANDLE)};

static const dem2di_field dem2di_slot_fields[] = {
    DEM2DI_SAVED("slot", dem2di_id_slot, slot, DEM2DI_TAG)};

static const dem2di_field dem2di_id_fields[] = {
    DEM2DI_SAVED("generation", dem2di_id_slot, generation, DEM2DI_HANDLE)};

static const dem2di_field dem2di_ranked_fields[] = {
    DEM2DI_SAVED("id", dem2di_ranked, index, DEM2DI_WHOLE(0, 1 << 30))};

static const dem2di_field dem2di_load_fields[] = {
    DEM2DI_SAVED("force", dem2di_load, force, DEM2DI_VECTOR),
    DEM2DI_SAVED("torque", dem2di_load, torque, DEM2DI_FINITE)};

static const dem2di_field dem2di_name_field[] = {DEM2DI_PLAIN("value", uint64_t, DEM2DI_WORD)};

static const dem2di_field dem2di_body_fields[] = {
    DEM2DI_SAVED("scale", dem2di_body, scale, DEM2DI_POSITIVE),
    DEM2DI_SAVED("shape", dem2di_body, shape_index, DEM2DI_WHOLE(-1, 1 << 30)),
    DEM2DI_SAVED("id", dem2di_body, index, DEM2DI_WHOLE(0, 1 << 30)),
    DEM2DI_SAVED("material", dem2di_body, material, DEM2DI_WHOLE(0, DEM2DI_MATERIALS_MAX - 1)),
    DEM2DI_SAVED("motion", dem2di_body, motion, DEM2DI_WHOLE(0, DEM2D_DRIVEN)),
    DEM2DI_SAVED("redirected", dem2di_body, redirected, DEM2DI_SWITCH)};

/* The radius follows from the shape. */
static const dem2di_field dem2di_state_fields[] = {
    DEM2DI_SAVED("position", dem2di_state, x, DEM2DI_VECTOR),
    DEM2DI_SAVED("rotation", dem2di_state, q, DEM2DI_VECTOR),
    DEM2DI_SAVED("velocity", dem2di_state, v, DEM2DI_VECTOR),
    DEM2DI_SAVED("angular_velocity", dem2di_state, w, DEM2DI_FINITE)};

static const dem2di_field dem2di_velocity_fields[] = {
    DEM2DI_SAVED("velocity", dem2di_velocities, v, DEM2DI_VECTOR),
    DEM2DI_SAVED("angular_velocity", dem2di_velocities, w, DEM2DI_FINITE)};

static const dem2di_field dem2di_wall_id_fields[] = {
    DEM2DI_SAVED("alive", dem2di_wall, alive, DEM2DI_SWITCH),
    DEM2DI_SAVED("generation", dem2di_wall, generation, DEM2DI_HANDLE)};

static const dem2di_field dem2di_wall_list_fields[] = {
    DEM2DI_SAVED("listed", dem2di_wall, listed, DEM2DI_VECTOR),
    DEM2DI_SAVED("reshaped", dem2di_wall, reshaped, DEM2DI_SWITCH),
    DEM2DI_SAVED("skin", dem2di_wall, skin, DEM2DI_FROM_0)};

static const dem2di_field dem2di_part_fields[] = {
    DEM2DI_SAVED("wall", dem2di_part, wall, DEM2DI_WHOLE(0, 1 << 30)),
    DEM2DI_SAVED("start", dem2di_part, start, DEM2DI_VECTOR),
    DEM2DI_SAVED("along", dem2di_part, along, DEM2DI_VECTOR),
    DEM2DI_SAVED("extent", dem2di_part, extent, DEM2DI_FROM_0)};

static const dem2di_field dem2di_wall_state_fields[] = {
    DEM2DI_SAVED("point", dem2di_wall_state, point, DEM2DI_VECTOR),
    DEM2DI_SAVED("velocity", dem2di_wall_state, velocity, DEM2DI_VECTOR),
    DEM2DI_SAVED("force", dem2di_wall_state, force, DEM2DI_VECTOR),
    DEM2DI_SAVED("drift", dem2di_wall_state, drift, DEM2DI_FINITE),
    DEM2DI_SAVED("stiffness", dem2di_wall_state, backing.stiffness, DEM2DI_MAY_OVERFLOW),
    DEM2DI_SAVED("impedance", dem2di_wall_state, backing.impedance, DEM2DI_MAY_OVERFLOW),
    DEM2DI_SAVED("mass", dem2di_wall_state, backing.mass, DEM2DI_MAY_OVERFLOW)};

static const dem2di_field dem2di_key_fields[] = {
    DEM2DI_SAVED("a", dem2di_key, a, DEM2DI_WHOLE(-1, 1 << 30)),
    DEM2DI_SAVED("b", dem2di_key, b, DEM2DI_WHOLE(0, 1 << 30))};

static const dem2di_field dem2di_arms_fields[] = {
    DEM2DI_SAVED("a_n", dem2di_arms, a_n, DEM2DI_FINITE),
    DEM2DI_SAVED("a_t", dem2di_arms, a_t, DEM2DI_FINITE),
    DEM2DI_SAVED("b_n", dem2di_arms, b_n, DEM2DI_FINITE),
    DEM2DI_SAVED("b_t", dem2di_arms, b_t, DEM2DI_FINITE)};

static const dem2di_field dem2di_history_fields[] = {
    DEM2DI_SAVED("bound", dem2di_history, bound, DEM2DI_FINITE),
    DEM2DI_SAVED("feature", dem2di_history, feature.own, DEM2DI_TAG),
    DEM2DI_SAVED("corners", dem2di_history, feature.corner, DEM2DI_TAG)};

static const dem2di_field dem2di_point_pair_fields[] = {
    DEM2DI_SAVED("weights", dem2di_point_pair, weight, DEM2DI_FINITE),
    DEM2DI_SAVED("depths", dem2di_point_pair, depth, DEM2DI_FINITE),
    DEM2DI_SAVED("offsets", dem2di_point_pair, offset, DEM2DI_FINITE),
    DEM2DI_SAVED("shears", dem2di_point_pair, shear, DEM2DI_FINITE),
    DEM2DI_SAVED("energy", dem2di_point_pair, energy, DEM2DI_FINITE),
    DEM2DI_SAVED("corners", dem2di_point_pair, corner, DEM2DI_TAG)};

static const dem2di_field dem2di_any_field[] = {DEM2DI_PLAIN("value", double, DEM2DI_ANY_NUMBER)};
static const dem2di_field dem2di_finite_field[] = {DEM2DI_PLAIN("value", double, DEM2DI_FINITE)};
static const dem2di_field dem2di_any_two[] = {
    DEM2DI_PLAIN("values", dem2di_two, DEM2DI_ANY_NUMBER)};
static const dem2di_field dem2di_finite_two[] = {DEM2DI_PLAIN("values", dem2di_two, DEM2DI_FINITE)};
static const dem2di_field dem2di_way_field[] = {DEM2DI_PLAIN("value", double, DEM2DI_FROM_0)};

/* A shape and its slot among the templates. */
typedef struct dem2di_slot_shape {
    int slot;
    dem2d_shape shape;
} dem2di_slot_shape;

#define DEM2DI_OF_SHAPE(name, field, range)                                \
    {                                                                      \
        name, range, sizeof(((dem2di_slot_shape *)0)->shape.field),        \
            offsetof(dem2di_slot_shape, shape.field) DEM2DI_FIELD_TEXT("") \
    }

static const dem2di_field dem2di_shape_fields[] = {
    DEM2DI_SAVED("slot", dem2di_slot_shape, slot, DEM2DI_COUNT),
    DEM2DI_OF_SHAPE("type", type, DEM2DI_CHOICE(DEM2D_SHAPE_TYPE_COUNT)),
    DEM2DI_OF_SHAPE("count", count, DEM2DI_COUNT),
    DEM2DI_OF_SHAPE("parts", parts, DEM2DI_COUNT),
    DEM2DI_OF_SHAPE("a", a, DEM2DI_FROM_0),
    DEM2DI_OF_SHAPE("b", b, DEM2DI_FROM_0),
    DEM2DI_OF_SHAPE("deviation", deviation, DEM2DI_FROM_0),
    DEM2DI_OF_SHAPE("rounding", rounding, DEM2DI_FROM_0),
    DEM2DI_OF_SHAPE("circumscribed", circumscribed, DEM2DI_POSITIVE),
    DEM2DI_OF_SHAPE("inscribed", inscribed, DEM2DI_FROM_0),
    DEM2DI_OF_SHAPE("rho_min", rho_min, DEM2DI_FROM_0),
    DEM2DI_OF_SHAPE("rho_max", rho_max, DEM2DI_MAY_OVERFLOW), /* where an arc is flat at a point */
    DEM2DI_OF_SHAPE("area", mass.area, DEM2DI_POSITIVE),
    DEM2DI_OF_SHAPE("polar_moment", mass.polar_moment, DEM2DI_POSITIVE),
    DEM2DI_OF_SHAPE("offset", offset, DEM2DI_VECTOR),
    DEM2DI_OF_SHAPE("tag", function_tag, DEM2DI_TAG)};

static const dem2di_field dem2di_vec_field[] = {DEM2DI_PLAIN("value", dem2d_vec, DEM2DI_VECTOR)};

static const dem2di_field dem2di_arc_fields[] = {
    DEM2DI_SAVED("start", dem2di_arc, start, DEM2DI_VECTOR),
    DEM2DI_SAVED("d0", dem2di_arc, d0, DEM2DI_VECTOR),
    DEM2DI_SAVED("d1", dem2di_arc, d1, DEM2DI_VECTOR),
    DEM2DI_SAVED("d2", dem2di_arc, d2, DEM2DI_VECTOR)};

static const dem2di_field dem2di_block_fields[] = {
    DEM2DI_SAVED("a", dem2di_block, a, DEM2DI_FINITE),
    DEM2DI_SAVED("b", dem2di_block, b, DEM2DI_FINITE)};

enum {
    DEM2DI_MOVES = 1,   /* with the particles, when these are sorted in memory */
    DEM2DI_SWAPS = 2,   /* with the column on the next line, which holds the next step's values */
    DEM2DI_HASHED = 4,  /* callers see it, or it decides what they will see */
    DEM2DI_FIRST = 8,   /* of its group in a snapshot, even if all is 0: no number of rows takes
                           memory without as many bytes */
    DEM2DI_SHARES = 16, /* its memory is that of another line, or of the world itself */
    DEM2DI_STORED =
        32 /* of contacts: carried over from list to list, kept in steps that look back */
};

/* A column in an object: a world, or a shape. */
typedef struct dem2di_column {
    const char *name; /* in snapshots; NULL: it is not saved */
    dem2di_group group;
    size_t at, size; /* where the object has its pointer; of an element */
    int treatment;
    const dem2di_field *fields;
    int count; /* of fields */
} dem2di_column;

#define DEM2DI_COLUMN(name, group, pointer, treatment, fields)                           \
    {                                                                                    \
        name, DEM2DI_##group, offsetof(dem2d_world, pointer),                            \
            sizeof(*((dem2d_world *)0)->pointer), treatment, DEM2DI_ALL(dem2di_##fields) \
    }
#define DEM2DI_UNSAVED(group, pointer, treatment)                    \
    {                                                                \
        NULL, DEM2DI_##group, offsetof(dem2d_world, pointer),        \
            sizeof(*((dem2d_world *)0)->pointer), treatment, NULL, 0 \
    }
#define DEM2DI_CONTACT_COLUMN(name, group, pointer, fields) \
    DEM2DI_COLUMN(name, group, list.contacts.pointer, DEM2DI_STORED | DEM2DI_HASHED, fields)
#define DEM2DI_SHAPE_COLUMN(name, group, pointer, fields)                             \
    {                                                                                 \
        name, DEM2DI_SHAPE_##group, offsetof(dem2di_slot_shape, shape.pointer),       \
            sizeof(*((dem2di_slot_shape *)0)->shape.pointer),                         \
            DEM2DI_SHARES | DEM2DI_FIRST | DEM2DI_HASHED, DEM2DI_ALL(dem2di_##fields) \
    }

static const dem2di_column dem2di_columns[] = {
    {"world", DEM2DI_WORLD, 0, 0, DEM2DI_SHARES | DEM2DI_HASHED, DEM2DI_ALL(dem2di_setting_fields)},
    {"progress", DEM2DI_WORLD, 0, 0, DEM2DI_SHARES, DEM2DI_ALL(dem2di_progress_fields)},
    {"plan", DEM2DI_WORLD, 0, 0, DEM2DI_SHARES, DEM2DI_ALL(dem2di_plan_fields)},
    {"ledger", DEM2DI_WORLD, 0, 0, DEM2DI_SHARES, DEM2DI_ALL(dem2di_ledger_fields)},
    DEM2DI_COLUMN("templates", TEMPLATES, templates, DEM2DI_FIRST | DEM2DI_HASHED, template_fields),
    DEM2DI_COLUMN("materials", MATERIALS, materials, DEM2DI_FIRST | DEM2DI_HASHED, material_fields),
    DEM2DI_COLUMN("laws", LAWS, laws, DEM2DI_FIRST | DEM2DI_HASHED, pair_fields),
    DEM2DI_COLUMN("ids", IDS, ids, DEM2DI_FIRST | DEM2DI_HASHED, id_fields),
    DEM2DI_COLUMN("slots", IDS, ids, DEM2DI_SHARES, slot_fields),
    DEM2DI_COLUMN("order", RANKS, order, DEM2DI_FIRST, ranked_fields),
    DEM2DI_COLUMN("particles", BODIES, bodies, DEM2DI_FIRST | DEM2DI_MOVES | DEM2DI_HASHED,
                  body_fields),
    DEM2DI_COLUMN("last_states", BODIES, before, DEM2DI_MOVES | DEM2DI_SWAPS | DEM2DI_HASHED,
                  state_fields),
    DEM2DI_COLUMN("states", BODIES, now, DEM2DI_MOVES | DEM2DI_HASHED, state_fields),
    DEM2DI_COLUMN("inverse_skins_squared", BODIES, inverse_skin_squared, 0, any_field),
    DEM2DI_UNSAVED(BODIES, inverse, DEM2DI_MOVES),
    DEM2DI_UNSAVED(BODIES, list.own, 0),
    DEM2DI_COLUMN("names", NAMES, names, DEM2DI_FIRST | DEM2DI_MOVES | DEM2DI_HASHED, name_field),
    DEM2DI_COLUMN("loads", LOADS, loads, DEM2DI_FIRST | DEM2DI_MOVES | DEM2DI_HASHED, load_fields),
    DEM2DI_COLUMN("displacements", DISPLACEMENTS, displacement, DEM2DI_MOVES | DEM2DI_SWAPS,
                  way_field),
    DEM2DI_UNSAVED(DISPLACEMENTS, next_displacement, 0),
    DEM2DI_UNSAVED(DISPLACEMENTS, lever, DEM2DI_MOVES),
    DEM2DI_COLUMN("last_velocities", MADE, made, DEM2DI_MOVES | DEM2DI_HASHED, velocity_fields),
    DEM2DI_UNSAVED(SUMS, sums, 0),
    DEM2DI_UNSAVED(EXCHANGED, exchange.force, 0),
    DEM2DI_UNSAVED(EXCHANGED, exchange.torque, 0),
    DEM2DI_UNSAVED(WALLS_EXCHANGED, exchange.wall_force, 0),
    DEM2DI_UNSAVED(STARTS, list.first, 0),
    DEM2DI_COLUMN("wall_ids", WALLS, walls, DEM2DI_FIRST | DEM2DI_HASHED, wall_id_fields),
    DEM2DI_COLUMN("walls", WALLS, walls, DEM2DI_SHARES | DEM2DI_HASHED, wall_fields),
    DEM2DI_COLUMN("wall_skins", WALLS, walls, DEM2DI_SHARES, wall_list_fields),
    DEM2DI_COLUMN("last_wall_states", WALLS, wall_before, DEM2DI_SWAPS | DEM2DI_HASHED,
                  wall_state_fields),
    DEM2DI_COLUMN("wall_states", WALLS, wall_now, DEM2DI_SWAPS | DEM2DI_HASHED, wall_state_fields),
    DEM2DI_UNSAVED(WALLS, wall_next, 0),
    DEM2DI_COLUMN("wall_parts", PARTS, parts, DEM2DI_FIRST | DEM2DI_HASHED, part_fields),
    DEM2DI_UNSAVED(PARTS, surfaces, 0),
    DEM2DI_COLUMN("pairs", KEYS, list.keys, DEM2DI_FIRST | DEM2DI_HASHED, key_fields),
    DEM2DI_CONTACT_COLUMN("normal_x", KEYS, normal_x, finite_field),
    DEM2DI_CONTACT_COLUMN("normal_y", KEYS, normal_y, finite_field),
    DEM2DI_CONTACT_COLUMN("depth", KEYS, depth, finite_field),
    DEM2DI_CONTACT_COLUMN("normal_force", KEYS, force, finite_field),
    DEM2DI_CONTACT_COLUMN("shear_force", KEYS, shear, finite_field),
    DEM2DI_CONTACT_COLUMN("moment", MOMENTS, moment, finite_field),
    DEM2DI_CONTACT_COLUMN("law_energy", CALLERS, energy, any_field), /* the caller's: anything */
    DEM2DI_CONTACT_COLUMN("law_state", CALLERS, state, any_two),
    DEM2DI_CONTACT_COLUMN("arms", GENERAL, arms, arms_fields),
    DEM2DI_COLUMN("histories", GENERAL, list.contacts.history, DEM2DI_STORED, history_fields),
    DEM2DI_CONTACT_COLUMN("two_points", POINT_PAIRS, point_pairs, point_pair_fields),
    DEM2DI_CONTACT_COLUMN("point_viscous_forces", POINT_VISCOUS, point_viscous, finite_two),
    DEM2DI_UNSAVED(ADJACENCY, list.adjacent, 0),
    DEM2DI_UNSAVED(BLOCK_RESULTS, block_results, 0),
    DEM2DI_UNSAVED(TREE, tree.boxes, 0),
    DEM2DI_UNSAVED(TREE, tree.items, 0),
    DEM2DI_UNSAVED(TREE, tree.found, 0),
    DEM2DI_UNSAVED(TREE, tree.spare, 0),
    {NULL, DEM2DI_SCRATCH, offsetof(dem2d_world, scratch), DEM2DI_LINE, 0, NULL, 0},
    /* of each shape, what its support points come from: the rest follows with the same bits */
    {"shape", DEM2DI_SHAPE, 0, 0, DEM2DI_SHARES | DEM2DI_HASHED, DEM2DI_ALL(dem2di_shape_fields)},
    DEM2DI_SHAPE_COLUMN("corners", COUNT, corners, vec_field),
    DEM2DI_SHAPE_COLUMN("given", COUNT, given, arc_fields),
    DEM2DI_SHAPE_COLUMN("arcs", PARTS, arcs, arc_fields),
    DEM2DI_SHAPE_COLUMN("tangents", PARTS, tangents, vec_field),
    DEM2DI_SHAPE_COLUMN("terms", BLOCKS, blocks, block_fields),
    DEM2DI_SHAPE_COLUMN("least_rho", SECTORS, least_rho, finite_field),
};

#define DEM2DI_COLUMNS ((int)(sizeof dem2di_columns / sizeof *dem2di_columns))

static void *dem2di_column_get(const void *object, const dem2di_column *column) {
    void *array;
    memcpy(&array, (const char *)object + column->at, sizeof array);
    return array;
}

static void dem2di_column_set(dem2d_world *world, const dem2di_column *column, void *array) {
    memcpy((char *)world + column->at, &array, sizeof array);
}

/* As dem2di_growth, with little to spare: for what is renewed as a whole. */
static int dem2di_room(int capacity, int needed) {
    int spare = needed / 16;
    return needed <= capacity ? capacity : needed < INT_MAX - spare ? needed + spare : needed;
}

/* Room for `needed` elements in all columns of a group, or nothing has changed. */
static bool dem2di_group_reserve(dem2d_world *world, dem2di_group group, int needed) {
    void *made[DEM2DI_COLUMNS];
    const dem2d_env *env = &world->env;
    const dem2di_column *columns = dem2di_columns;
    int old = world->capacity[group];
    int grown = group < DEM2DI_KEYS ? dem2di_growth(old, needed) : dem2di_room(old, needed);
    if (grown == old) return true;
    for (int k = 0; k < DEM2DI_COLUMNS; k++) {
        made[k] = NULL;
        if (columns[k].group != group || (columns[k].treatment & DEM2DI_SHARES)) continue;
        made[k] = dem2di_lengthened(env, dem2di_column_get(world, &columns[k]), columns[k].size,
                                    old, grown);
        if (made[k] != NULL) continue;
        while (k-- > 0) dem2di_release(env, made[k], (size_t)grown, columns[k].size);
        return false;
    }
    for (int k = 0; k < DEM2DI_COLUMNS; k++) {
        if (made[k] == NULL) continue;
        dem2di_release(env, dem2di_column_get(world, &columns[k]), (size_t)old, columns[k].size);
        dem2di_column_set(world, &columns[k], made[k]);
    }
    world->capacity[group] = grown;
    return true;
}

static void dem2di_columns_release(dem2d_world *world) {
    for (int k = 0; k < DEM2DI_COLUMNS; k++) {
        const dem2di_column *column = &dem2di_columns[k];
        if (column->treatment & DEM2DI_SHARES) continue;
        dem2di_release(&world->env, dem2di_column_get(world, column),
                       (size_t)world->capacity[column->group], column->size);
    }
}

/* The next step's values become the present ones. */
static void dem2di_columns_swap(dem2d_world *world) {
    for (int k = 0; k < DEM2DI_COLUMNS; k++) {
        const dem2di_column *column = &dem2di_columns[k];
        if (!(column->treatment & DEM2DI_SWAPS)) continue;
        void *present = dem2di_column_get(world, column);
        dem2di_column_set(world, column, dem2di_column_get(world, column + 1));
        dem2di_column_set(world, column + 1, present);
    }
}

/* Size of the largest element that moves with its particle. */
static size_t dem2di_moved_size(void) {
    size_t most = 0;
    for (int k = 0; k < DEM2DI_COLUMNS; k++)
        if ((dem2di_columns[k].treatment & DEM2DI_MOVES) && dem2di_columns[k].size > most)
            most = dem2di_columns[k].size;
    return most;
}

/* What moves with the particles, in a new order: of `slots` elements number i goes to to[i], or is
   dropped when that is -1; `count` are left. The spare memory has room for a whole column. */
static void dem2di_columns_move(dem2d_world *world, const int *to, int slots, int count,
                                char *spare) {
    for (int k = 0; k < DEM2DI_COLUMNS; k++) {
        const dem2di_column *column = &dem2di_columns[k];
        size_t size = column->size;
        if (!(column->treatment & DEM2DI_MOVES)) continue;
        if (world->capacity[column->group] < slots) continue; /* the scene has no use for it */
        char *array = (char *)dem2di_column_get(world, column);
        for (int i = 0; i < slots; i++)
            if (to[i] >= 0) memcpy(spare + (size_t)to[i] * size, array + (size_t)i * size, size);
        if (count > 0) memcpy(array, spare, (size_t)count * size);
    }
}

/* A new row has no past: all of it is 0, in all columns from one group to another that are in use.
 */
static void dem2di_row_clear(dem2d_world *world, dem2di_group first, dem2di_group last, int row) {
    for (int k = 0; k < DEM2DI_COLUMNS; k++) {
        const dem2di_column *column = &dem2di_columns[k];
        if (column->group < first || column->group > last || (column->treatment & DEM2DI_SHARES))
            continue;
        if (row >= world->capacity[column->group]) continue;
        char *array = (char *)dem2di_column_get(world, column);
        memset(array + (size_t)row * column->size, 0, column->size);
    }
}

/* Room for particles, in all columns of particles that are in use. */
static bool dem2di_reserve_bodies(dem2d_world *world, int count) {
    return dem2di_group_reserve(world, DEM2DI_BODIES, count) &&
           dem2di_group_reserve(world, DEM2DI_STARTS, count + 1) &&
           dem2di_group_reserve(world, DEM2DI_IDS, count) &&
           (!world->named || (dem2di_group_reserve(world, DEM2DI_RANKS, count) &&
                              dem2di_group_reserve(world, DEM2DI_NAMES, count))) &&
           (!world->loaded || dem2di_group_reserve(world, DEM2DI_LOADS, count)) &&
           (!world->plan.turns || dem2di_group_reserve(world, DEM2DI_DISPLACEMENTS, count)) &&
           (!world->redirected || dem2di_group_reserve(world, DEM2DI_MADE, count));
}

/* Does the scene need the columns of a group of contacts? */
static bool dem2di_plan_needs(const dem2di_plan *plan, dem2di_group group) {
    const int terms = plan->terms;
    if (group == DEM2DI_MOMENTS) return (terms & DEM2DI_ROLLING) != 0;
    if (group == DEM2DI_CALLERS) return (terms & DEM2DI_CALLERS_LAW) != 0;
    if (group == DEM2DI_POINT_PAIRS) return plan->faces;
    if (group == DEM2DI_POINT_VISCOUS) return plan->faces && (terms & DEM2DI_DASHPOT);
    return true;
}

/* The first of so many contacts that has an element in the columns of a group, or none has. */
static int dem2di_contacts_begin(const dem2di_plan *plan, int discs, int count,
                                 dem2di_group group) {
    if (!dem2di_plan_needs(plan, group)) return count;
    return group < DEM2DI_GENERAL ? 0 : discs;
}

/* Room for so many contacts. */
static bool dem2di_list_reserve(dem2d_world *world, const dem2di_plan *plan, int discs, int count) {
    for (int k = DEM2DI_KEYS; k < DEM2DI_ADJACENCY; k++) {
        dem2di_group group = (dem2di_group)k;
        int begin = dem2di_contacts_begin(plan, discs, count, group);
        if (!dem2di_group_reserve(world, group, count - begin)) return false;
    }
    return true;
}

/* The column of list.last that is as this one of list.contacts. */
static dem2di_column dem2di_column_last(const dem2di_column *column) {
    dem2di_column last = *column;
    last.at += offsetof(dem2d_world, list.last) - offsetof(dem2d_world, list.contacts);
    return last;
}

/* Bytes of the largest column of so many contacts. */
static size_t dem2di_contacts_largest(const dem2di_plan *plan, int discs, int count) {
    size_t most = 0;
    for (int k = 0; k < DEM2DI_COLUMNS; k++) {
        const dem2di_column *column = &dem2di_columns[k];
        int begin = dem2di_contacts_begin(plan, discs, count, column->group);
        size_t bytes = (size_t)(count - begin) * column->size;
        if ((column->treatment & DEM2DI_STORED) && bytes > most) most = bytes;
    }
    return most;
}

/* Contacts from `first` to before `end` as they are into list.last, or (`back`) as they were from
   there. */
static void dem2di_contacts_keep(dem2d_world *world, int first, int end, bool back) {
    const dem2di_list *list = &world->list;
    for (int k = 0; k < DEM2DI_COLUMNS; k++) {
        const dem2di_column *column = &dem2di_columns[k];
        if (!(column->treatment & DEM2DI_STORED)) continue;
        int begin = dem2di_contacts_begin(&world->plan, list->discs, list->count, column->group);
        int from = first > begin ? first - begin : 0;
        if (end - begin <= from) continue;
        size_t at = (size_t)from * column->size, bytes = (size_t)(end - begin) * column->size - at;
        dem2di_column last = dem2di_column_last(column);
        char *now = (char *)dem2di_column_get(world, column) + at;
        char *then = (char *)dem2di_column_get(world, &last) + at;
        memcpy(back ? now : then, back ? then : now, bytes);
    }
}

static dem2d_result dem2di_out_of_memory(const dem2d_world *world, const char *what) {
    return dem2di_fail(&world->env, DEM2D_OUT_OF_MEMORY, -1, "no memory for %s", what);
}

/* ============================================================================================
   >>objects  Objects with ids: shapes, materials, particles, and what queries read of them
   uses: config, math, memory, fields, shapes, gjk, broad, law, motion, world
   ============================================================================================ */

DEM2D_API void dem2d_world_destroy(dem2d_world *world) {
    if (world == NULL) return;
    for (int i = 0; i < world->capacity[DEM2DI_TEMPLATES]; i++)
        dem2d_shape_destroy(world->templates[i].shape);
    dem2d_shape_destroy(world->line);
    dem2di_columns_release(world);
    dem2d_env user = world->user_env;
    dem2di_release(&user, world, 1, sizeof *world);
}

static const dem2di_field dem2di_world_fields[] = {
    DEM2DI_ROW(dem2d_world_desc, time_step, DEM2DI_POSITIVE, "s none"),
    DEM2DI_ROW(dem2d_world_desc, gravity, DEM2DI_VECTOR, "m/s2 0"),
    DEM2DI_ROW(dem2d_world_desc, local_damping, DEM2DI_FRACTION, "- 0"),
    DEM2DI_ROW(dem2d_world_desc, global_damping, DEM2DI_FROM_0, "1/s 0"),
    DEM2DI_ROW(dem2d_world_desc, skin, DEM2DI_FROM_0, "- by itself; of the particle radius"),
    DEM2DI_ROW(dem2d_world_desc, contact_tolerance, DEM2DI_FROM_0, "- 1e-8; of R_A + R_B + |d|"),
    DEM2DI_ROW(dem2d_world_desc, max_iterations, DEM2DI_WHOLE(0, 1 << 30), "- 128"),
    DEM2DI_ROW(dem2d_world_desc, solver, DEM2DI_CHOICE(DEM2D_SOLVER_COUNT), "- CERTIFIED"),
    DEM2DI_ROW(dem2d_world_desc, faces, DEM2DI_CHOICE(DEM2D_FACE_RULE_COUNT), "- TWO_POINTS"),
    DEM2DI_ROW(dem2d_world_desc, particle_capacity, DEM2DI_WHOLE(0, 1 << 30), "- grows"),
    DEM2DI_ROW(dem2d_world_desc, pair_capacity, DEM2DI_WHOLE(0, 1 << 30), "- grows"),
    DEM2DI_ROW(dem2d_world_desc, skip_time_step_check, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_world_desc, ledger, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_world_desc, law, DEM2DI_OPTIONAL, "- NULL; springs and friction"),
    DEM2DI_ROW(dem2d_world_desc, law_user, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_world_desc, law_tag, DEM2DI_TAG, "- 0"),
    DEM2DI_ROW(dem2d_world_desc, parallel_for, DEM2DI_OPTIONAL, "- NULL; one thread does all"),
    DEM2DI_ROW(dem2d_world_desc, parallel_user, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_world_desc, env, DEM2DI_OPTIONAL, "- NULL; copied"),
    DEM2DI_ROW(dem2d_world_desc, gather, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_world_desc, commit, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_world_desc, exchange_user, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_world_desc, loads, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_world_desc, loads_user, DEM2DI_OPTIONAL, "- NULL"),
};

DEM2D_API dem2d_result dem2d_world_create(const dem2d_world_desc *desc, dem2d_world **world) {
    if (desc == NULL) return DEM2D_NULL_ARGUMENT;
    if (world == NULL) return dem2di_fail_null(desc->env, "world");
    dem2d_result result = dem2di_check_fields(desc->env, DEM2DI_ALL(dem2di_world_fields), desc);
    if (result != DEM2D_OK) return result;
    dem2d_world *made = (dem2d_world *)dem2di_allocate(desc->env, 1, sizeof *made);
    if (made == NULL) return dem2di_fail(desc->env, DEM2D_OUT_OF_MEMORY, -1, "no memory for world");
    memset((void *)made, 0, sizeof *made);
    if (desc->env != NULL) made->user_env = *desc->env;
    made->bytes = sizeof *made;
    made->env.user = made;
    made->env.allocate = dem2di_world_allocate;
    made->env.release = dem2di_world_release;
    made->env.log = dem2di_world_log;
    made->time_step = made->made_step = desc->time_step;
    made->gravity = desc->gravity;
    made->local_damping = desc->local_damping;
    made->global_damping = desc->global_damping;
    made->ledger.kept = made->ledger.edited = desc->ledger;
    made->law = desc->law;
    made->law_user = desc->law_user;
    made->law_tag = desc->law_tag;
    made->has_law = desc->law != NULL;
    made->parallel_for = desc->parallel_for;
    made->parallel_user = desc->parallel_user;
    made->gather = desc->gather;
    made->commit = desc->commit;
    made->exchange_user = desc->exchange_user;
    made->set_loads = desc->loads;
    made->loads_user = desc->loads_user;
    made->skin_fixed = desc->skin > 0;
    made->skin = made->skin_fixed ? desc->skin : DEM2DI_SKIN_FIRST;
    made->interval = DEM2DI_INTERVAL_FIRST;
    made->scattered = true;
    made->free_id = -1;
    made->tolerance = desc->contact_tolerance == 0 ? 1e-8 : desc->contact_tolerance;
    made->max_iterations = desc->max_iterations == 0 ? 128 : desc->max_iterations;
    made->solver = desc->solver;
    made->faces = desc->faces;
    made->check_time_step = !desc->skip_time_step_check;
    if (!dem2di_reserve_bodies(made, desc->particle_capacity) ||
        !dem2di_list_reserve(made, &made->plan, desc->pair_capacity, desc->pair_capacity)) {
        result = dem2di_out_of_memory(made, "the capacities asked for");
        dem2d_world_destroy(made);
        return result;
    }
    *world = made;
    return DEM2D_OK;
}

/* An edit may change the features in use, or bounds of the motion: see dem2di_plan_make for why
   they are found anew in two steps. */
static void dem2di_edited(dem2d_world *world) {
    world->plan_due = 2;
}

/* Ids: an index in range whose slot is in use with this generation. */
static bool dem2di_shape_lives(const dem2d_world *w, dem2d_shape_id id) {
    return (int64_t)id.index < w->template_count && w->templates[id.index].shape != NULL &&
           w->templates[id.index].generation == id.generation;
}

static bool dem2di_material_lives(const dem2d_world *w, dem2d_material_id id) {
    return (int64_t)id.index < w->material_count && id.generation == 1; /* never removed */
}

/* Slot of a particle, or -1 for a stale id. */
static int dem2di_slot(const dem2d_world *w, dem2d_particle_id id) {
    if ((int64_t)id.index >= w->id_count) return -1;
    const dem2di_id_slot *entry = &w->ids[id.index];
    return entry->slot >= 0 && entry->generation == id.generation ? entry->slot : -1;
}

static bool dem2di_wall_lives(const dem2d_world *w, dem2d_wall_id id) {
    return (int64_t)id.index < w->wall_count && w->walls[id.index].alive &&
           w->walls[id.index].generation == id.generation;
}

static dem2d_particle_id dem2di_particle_id(const dem2d_world *world, int slot) {
    dem2d_particle_id id;
    id.index = (uint32_t)world->bodies[slot].index;
    id.generation = world->ids[id.index].generation;
    return id;
}

/* The slot of the particle at a place of the order of names and ids, -1 where there is none: sums
   over particles go through all places. */
static inline int dem2di_slot_at(const dem2d_world *world, int place) {
    return world->ids[world->named ? world->order[place].index : place].slot;
}

static dem2d_wall_id dem2di_wall_id(const dem2d_world *world, int slot) {
    dem2d_wall_id id;
    id.index = (uint32_t)slot;
    id.generation = world->walls[slot].generation;
    return id;
}

static dem2d_result dem2di_stale(const dem2d_world *w, const char *kind, uint32_t index) {
    return dem2di_fail(&w->env, DEM2D_STALE_ID, (int)(index & INT_MAX), "no such %s", kind);
}

DEM2D_API dem2d_result dem2d_world_add_shape(dem2d_world *world, const dem2d_shape *shape,
                                             dem2d_shape_id *id) {
    if (world == NULL || shape == NULL || id == NULL) return DEM2D_NULL_ARGUMENT;
    int slot = 0;
    while (slot < world->template_count && world->templates[slot].shape != NULL) slot++;
    if (!dem2di_group_reserve(world, DEM2DI_TEMPLATES, slot + 1))
        return dem2di_out_of_memory(world, "a template");
    dem2d_shape *copy = dem2di_shape_copy(&world->env, shape);
    if (copy == NULL) return DEM2D_OUT_OF_MEMORY;
    dem2di_template *place = &world->templates[slot];
    place->shape = copy;
    place->generation++;
    place->users = 0;
    if (slot == world->template_count) world->template_count++;
    id->index = (uint32_t)slot;
    id->generation = place->generation;
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_remove_shape(dem2d_world *world, dem2d_shape_id id) {
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    if (!dem2di_shape_lives(world, id)) return dem2di_stale(world, "shape", id.index);
    dem2di_template *place = &world->templates[id.index];
    if (place->users > 0)
        return dem2di_fail(&world->env, DEM2D_IN_USE, (int)id.index, "shape of %d particles",
                           place->users);
    dem2d_shape_destroy(place->shape);
    place->shape = NULL;
    return DEM2D_OK;
}

DEM2D_API const dem2d_shape *dem2d_world_shape(const dem2d_world *world, dem2d_shape_id id) {
    return world != NULL && dem2di_shape_lives(world, id) ? world->templates[id.index].shape : NULL;
}

/* Springs in series, doubled: two equal materials meet with their own stiffness. */
static double dem2di_mean_stiffness(double a, double b) {
    double mean = a / 2 + b / 2; /* of the greatest numbers, too */
    return mean > 0 ? a * (b / mean) : 0;
}

static dem2d_pair_desc dem2di_mix(const dem2d_material_desc *a, const dem2d_material_desc *b) {
    dem2d_pair_desc law;
    law.normal_stiffness = dem2di_mean_stiffness(a->normal_stiffness, b->normal_stiffness);
    law.tangential_stiffness =
        dem2di_mean_stiffness(a->tangential_stiffness, b->tangential_stiffness);
    law.friction = dem2di_min(a->friction, b->friction);
    law.damping_ratio = dem2di_max(a->damping_ratio, b->damping_ratio);
    law.rolling_friction = dem2di_min(a->rolling_friction, b->rolling_friction);
    return law;
}

static inline dem2d_pair_desc *dem2di_law(const dem2d_world *world, int a, int b) {
    return &world->laws[a * world->laws_side + b];
}

/* How two materials meet from now on. Without a tangential spring there is no friction, nor against
   rolling, whose spring is made of it: springs that a law before it has left would stay. A caller's
   law gets the numbers as they are. */
static void dem2di_law_set(dem2d_world *world, int a, int b, const dem2d_pair_desc *desc) {
    dem2d_pair_desc law = *desc;
    if (!(law.tangential_stiffness > 0) && world->law == NULL)
        law.friction = law.rolling_friction = 0;
    *dem2di_law(world, a, b) = *dem2di_law(world, b, a) = law;
}

/* The wall whose part a listed contact is with. */
static inline int dem2di_wall_of(const dem2d_world *world, int contact) {
    return world->parts[world->list.keys[contact].b].wall;
}

/* How the two of a listed contact meet; B is a particle or a wall. */
static inline const dem2d_pair_desc *dem2di_law_of(const dem2d_world *world, int contact) {
    const dem2di_key *key = &world->list.keys[contact];
    int material = contact >= world->list.pairs
                       ? (int)world->walls[dem2di_wall_of(world, contact)].desc.material.index
                       : world->bodies[key->b].material;
    return dem2di_law(world, world->bodies[key->a].material, material);
}

/* Room for the laws of one material more; those that are there keep their places. */
static bool dem2di_widen_laws(dem2d_world *world) {
    int old = world->laws_side, wider = old + 1;
    if (!dem2di_group_reserve(world, DEM2DI_LAWS, wider * wider)) return false;
    for (int row = old - 1; row >= 0; row--)
        memmove(world->laws + row * wider, world->laws + row * old,
                (size_t)old * sizeof *world->laws);
    world->laws_side = wider;
    return true;
}

DEM2D_API dem2d_result dem2d_world_add_material(dem2d_world *world, const dem2d_material_desc *desc,
                                                dem2d_material_id *id) {
    if (world == NULL || desc == NULL || id == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result =
        dem2di_check_fields(&world->env, DEM2DI_ALL(dem2di_material_fields), desc);
    if (result != DEM2D_OK) return result;
    int slot = world->material_count;
    if (slot == DEM2DI_MATERIALS_MAX)
        return dem2di_fail(&world->env, DEM2D_OUT_OF_RANGE, slot, "more than %d materials", slot);
    if (!dem2di_group_reserve(world, DEM2DI_MATERIALS, slot + 1) || !dem2di_widen_laws(world))
        return dem2di_out_of_memory(world, "a material");
    world->materials[slot] = *desc;
    world->material_count++;
    for (int i = 0; i <= slot; i++) {
        const dem2d_pair_desc law = dem2di_mix(&world->materials[i], desc);
        dem2di_law_set(world, i, slot, &law);
    }
    id->index = (uint32_t)slot;
    id->generation = 1;
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_set_pair(dem2d_world *world, dem2d_material_id a,
                                            dem2d_material_id b, const dem2d_pair_desc *desc) {
    if (world == NULL || desc == NULL) return DEM2D_NULL_ARGUMENT;
    if (!dem2di_material_lives(world, a)) return dem2di_stale(world, "material", a.index);
    if (!dem2di_material_lives(world, b)) return dem2di_stale(world, "material", b.index);
    dem2d_result result = dem2di_check_fields(&world->env, DEM2DI_ALL(dem2di_pair_fields), desc);
    if (result != DEM2D_OK) return result;
    dem2d_pair_desc *law = dem2di_law(world, (int)a.index, (int)b.index), old = *law;
    dem2di_law_set(world, (int)a.index, (int)b.index, desc);
    if (memcmp(&old, law, sizeof old) == 0) return DEM2D_OK;
    world->check_due = world->ledger.edited = true;
    dem2di_edited(world);
    return DEM2D_OK;
}

/* Angles beyond this have lost all their digits after 1e-7, and rotations are not defined. */
#define DEM2DI_ANGLE DEM2DI_NUMBER(-1073741824.0, 1073741824.0, 0) /* 2^30 */

static const dem2di_field dem2di_particle_fields[] = {
    DEM2DI_ROW(dem2d_particle_desc, scale, DEM2DI_POSITIVE, "- none"),
    DEM2DI_ROW(dem2d_particle_desc, shape, DEM2DI_HANDLE, "- none; a shape of this world"),
    DEM2DI_ROW(dem2d_particle_desc, material, DEM2DI_HANDLE, "- none; a material of this world"),
    DEM2DI_ROW(dem2d_particle_desc, motion, DEM2DI_CHOICE(DEM2D_DRIVEN + 1), "- FREE"),
    DEM2DI_ROW(dem2d_particle_desc, position, DEM2DI_VECTOR, "m 0"),
    DEM2DI_ROW(dem2d_particle_desc, angle, DEM2DI_ANGLE, "rad 0"),
    DEM2DI_ROW(dem2d_particle_desc, velocity, DEM2DI_VECTOR, "m/s 0; 0 when FIXED"),
    DEM2DI_ROW(dem2d_particle_desc, angular_velocity, DEM2DI_FINITE, "rad/s 0; 0 when FIXED"),
    DEM2DI_ROW(dem2d_particle_desc, name, DEM2DI_WORD, "- 0"),
};

/* A particle as it is described, but for its ids. */
static dem2d_result dem2di_check_motion(const dem2d_env *env, const dem2d_particle_desc *desc) {
    dem2d_result result = dem2di_check_fields(env, DEM2DI_ALL(dem2di_particle_fields), desc);
    bool moves = desc->velocity.x != 0 || desc->velocity.y != 0 || desc->angular_velocity != 0;
    if (result != DEM2D_OK || desc->motion != DEM2D_FIXED || !moves) return result;
    return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "velocity of a fixed particle is not 0");
}

/* A good description, of which a caller changes a part. */
static dem2d_particle_desc dem2di_particle_plain(void) {
    dem2d_particle_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.scale = 1;
    return desc;
}

static dem2d_result dem2di_check_particle(const dem2d_world *world,
                                          const dem2d_particle_desc *desc) {
    if (!dem2di_shape_lives(world, desc->shape))
        return dem2di_stale(world, "shape", desc->shape.index);
    if (!dem2di_material_lives(world, desc->material))
        return dem2di_stale(world, "material", desc->material.index);
    return dem2di_check_motion(&world->env, desc);
}

/* The template of a body that is there. */
static const dem2d_shape *dem2di_shape_of(const dem2d_world *world, const dem2di_body *body) {
    return world->templates[body->shape_index].shape;
}

static bool dem2di_is_circle(const dem2d_world *world, int slot) {
    return dem2di_shape_of(world, &world->bodies[slot])->type == DEM2D_CIRCLE;
}

static double dem2di_body_mass(const dem2d_world *world, const dem2di_body *body) {
    double square = body->scale * body->scale;
    return world->materials[body->material].density * dem2di_shape_of(world, body)->mass.area *
           square;
}

static double dem2di_body_inertia(const dem2d_world *world, const dem2di_body *body) {
    double moment = dem2di_shape_of(world, body)->mass.polar_moment;
    double square = body->scale * body->scale;
    return world->materials[body->material].density * moment * square * square;
}

static dem2di_inverse dem2di_inverse_of(const dem2d_world *world, const dem2di_body *body) {
    dem2di_inverse inverse = {0, 0};
    if (body->motion != DEM2D_FREE) return inverse;
    inverse.mass = 1 / dem2di_body_mass(world, body);
    inverse.inertia = 1 / dem2di_body_inertia(world, body);
    return inverse;
}

/* As states hold it: while there are only circles, whose rotation nothing but a query asks for, the
   angle itself, in c. */
static dem2d_rot dem2di_orientation(const dem2d_world *world, double angle) {
    dem2d_rot q = {angle, 0};
    return world->plan.turns ? dem2d_rot_make(angle) : q;
}

/* The index of the next id: one that is free again, or a new one. */
static int dem2di_id_take(dem2d_world *world) {
    int index = world->free_id;
    if (index < 0) {
        index = world->id_count++;
        world->ids[index].generation = 0;
        if (world->named) world->order[index].index = world->order[index].rank = index;
    } else {
        world->free_id = -2 - world->ids[index].slot;
    }
    world->ids[index].generation++;
    return index;
}

static void dem2di_id_release(dem2d_world *world, int index) {
    world->ids[index].slot = -2 - world->free_id;
    world->free_id = index;
}

/* Names of particles, when the first has one: so far all are in the order of ids. */
static bool dem2di_names_begin(dem2d_world *world) {
    int ids = world->id_count > world->body_count ? world->id_count : world->body_count;
    if (world->named) return true;
    if (!dem2di_group_reserve(world, DEM2DI_RANKS, ids + 1) ||
        !dem2di_group_reserve(world, DEM2DI_NAMES, world->body_count + 1))
        return false;
    for (int i = 0; i < world->id_count; i++) world->order[i].index = world->order[i].rank = i;
    for (int i = 0; i < world->body_count; i++) world->names[i] = 0;
    return world->named = true;
}

DEM2D_API dem2d_result dem2d_world_add_particle(dem2d_world *world, const dem2d_particle_desc *desc,
                                                dem2d_particle_id *id) {
    if (world == NULL || desc == NULL || id == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_particle(world, desc);
    if (result != DEM2D_OK) return result;
    dem2di_body body;
    memset(&body, 0, sizeof body);
    body.scale = desc->scale;
    body.shape_index = (int)desc->shape.index;
    body.material = (uint16_t)desc->material.index;
    body.motion = (uint8_t)desc->motion;
    double mass = dem2di_body_mass(world, &body), inertia = dem2di_body_inertia(world, &body);
    if (!(mass > 0 && inertia > 0 && dem2di_finite(mass) && dem2di_finite(inertia)))
        return dem2di_fail(&world->env, DEM2D_OUT_OF_RANGE, -1, "scale = %g gives mass %g",
                           desc->scale, mass);
    int slot = world->body_count;
    if (slot == 1 << 30)
        return dem2di_fail(&world->env, DEM2D_OUT_OF_RANGE, -1, "more than %d particles", slot);
    if (!dem2di_reserve_bodies(world, slot + 1) || (desc->name != 0 && !dem2di_names_begin(world)))
        return dem2di_out_of_memory(world, "a particle");
    dem2di_row_clear(world, DEM2DI_BODIES, DEM2DI_MADE, slot);
    body.index = dem2di_id_take(world);
    body.rank = world->named ? world->order[body.index].rank : body.index;
    if (world->named) world->names[slot] = desc->name;
    world->order_due = world->named;
    world->ids[body.index].slot = slot;
    world->bodies[slot] = body;
    world->inverse[slot] = dem2di_inverse_of(world, &body);
    world->templates[desc->shape.index].users++;
    dem2di_state state;
    state.x = desc->position;
    state.q = dem2di_orientation(world, desc->angle);
    state.v = desc->velocity;
    state.w = desc->angular_velocity;
    state.radius = dem2di_shape_of(world, &body)->circumscribed * desc->scale;
    world->now[slot] = world->before[slot] = state;

    world->list.first[slot + 1] = world->list.own[slot] = world->list.first[slot]; /* none yet */
    world->body_count++;
    world->tree.made = false;
    world->list_stale = world->check_due = true;
    world->ledger.edited = true;
    dem2di_edited(world);
    id->index = (uint32_t)body.index;
    id->generation = world->ids[body.index].generation;
    return DEM2D_OK;
}

/* What terms of the law and two points keep of contact i: nothing. */
static void dem2di_terms_clear(dem2d_world *world, int i) {
    const dem2di_contacts *contacts = &world->list.contacts;
    const int terms = world->plan.terms, at = i - world->list.discs;
    if (terms & DEM2DI_ROLLING) contacts->moment[i] = 0;
    if (terms & DEM2DI_CALLERS_LAW) {
        contacts->energy[i] = 0;
        memset(&contacts->state[i], 0, sizeof *contacts->state);
    }
    if (!world->plan.faces || at < 0) return;
    memset(&contacts->point_pairs[at], 0, sizeof *contacts->point_pairs);
    if (terms & DEM2DI_DASHPOT)
        memset(&contacts->point_viscous[at], 0, sizeof *contacts->point_viscous);
}

/* Contact i has no force and no history: the two are apart. */
static inline void dem2di_contact_clear(dem2d_world *world, int i) {
    world->list.contacts.force[i] = world->list.contacts.shear[i] = 0;
    if (world->plan.terms != 0 || world->plan.faces) dem2di_terms_clear(world, i);
}

/* A contact ends: its pair is apart, and leaves with the next list. */
static void dem2di_contact_forget(dem2d_world *world, int i) {
    dem2di_list *list = &world->list;
    list->keys[i].a = -1;
    list->contacts.depth[i] = 0;
    dem2di_contact_clear(world, i);
}

/* Contacts of a particle are forgotten. */
static void dem2di_forget(dem2d_world *world, int slot) {
    dem2di_list *list = &world->list;
    for (int k = list->first[slot]; k < list->first[slot + 1]; k++)
        dem2di_contact_forget(world, list->adjacent[k]);
    world->list_stale = true;
    world->ledger.edited = true;
}

DEM2D_API dem2d_result dem2d_world_remove_particle(dem2d_world *world, dem2d_particle_id id) {
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    int slot = dem2di_slot(world, id);
    if (slot < 0) return dem2di_stale(world, "particle", id.index);
    dem2di_body *body = &world->bodies[slot];
    world->templates[body->shape_index].users--;
    body->shape_index = -1;
    world->holes++;
    world->tree.made = false;
    dem2di_forget(world, slot);
    dem2di_edited(world);
    dem2di_id_release(world, (int)id.index);
    return DEM2D_OK;
}

static dem2d_pose dem2di_pose_of(const dem2d_world *world, const dem2di_state *states, int i) {
    dem2d_pose pose;
    pose.position = states[i].x;
    pose.rotation = world->plan.turns ? states[i].q : dem2d_rot_make(states[i].q.c);
    pose.scale = world->bodies[i].scale;
    return pose;
}

/* Radius of the circle of equal area. */
static double dem2di_equivalent(const dem2d_world *world, int slot) {
    const dem2di_body *body = &world->bodies[slot];
    if (dem2di_shape_of(world, body)->type == DEM2D_CIRCLE) return world->now[slot].radius;
    return body->scale * sqrt(dem2di_shape_of(world, body)->mass.area / DEM2DI_PI);
}

/* From the centre of one circle to another's, never so short that its square is no normal number.
 */
static DEM2DI_INLINE dem2d_vec dem2di_disc_line(const dem2di_state *a, const dem2di_state *b) {
    dem2d_vec d = dem2di_centre_line(a->x, b->x), u;
    if (dem2di_dot(d, d) > 1e-280) return d;
    return dem2di_scale(dem2di_unit(d, &u) ? u : dem2di_vec(1, 0), 1e-139);
}

/* Two circles: the normal force along the line of centres, the tangential spring at the middle of
   the overlap. The force is 0 when they are apart. */
typedef struct dem2di_round {
    dem2d_vec normal;
    double depth, force;
    double arm_a, arm_b; /* from the centres to the contact point */
} dem2di_round;

static DEM2DI_INLINE dem2di_round dem2di_round_make(dem2d_vec d, double radius_a, double radius_b,
                                                    double stiffness) {
    dem2di_round round;
    double square = d.x * d.x + d.y * d.y, distance = sqrt(square);
    double f = distance * (1 / square); /* root and division side by side */
    round.normal.x = d.x * f;
    round.normal.y = d.y * f;
    round.depth = radius_a + radius_b - distance;
    round.force = stiffness * (round.depth > 0 ? round.depth : 0);
    round.arm_a = radius_a - round.depth / 2;
    round.arm_b = radius_b - round.depth / 2;
    return round;
}

/* Of the equivalent radii of the two of a listed contact; a wall is flat. */
static double dem2di_reduced_radius(const dem2d_world *world, int contact) {
    const dem2di_key *key = &world->list.keys[contact];
    double radius = dem2di_equivalent(world, key->a);
    if (contact >= world->list.pairs) return radius;
    double other = dem2di_equivalent(world, key->b);
    return radius * (other / (radius + other));
}

/* 1/m of the two of a listed contact; 0 when neither is free (at a servo wall). */
static double dem2di_reduced_inverse(const dem2d_world *world, int contact) {
    const dem2di_key *key = &world->list.keys[contact];
    double inverse = world->inverse[key->a].mass;
    return contact >= world->list.pairs ? inverse : inverse + world->inverse[key->b].mass;
}

/* Can no force move the two of a listed pair against each other? Neither particle is free, and the
   wall is no servo wall. Such a pair is no contact. */
static inline bool dem2di_immovable(const dem2d_world *world, int i) {
    const dem2di_key *key = &world->list.keys[i];
    if (i < world->list.pairs)
        return !(world->inverse[key->a].mass + world->inverse[key->b].mass > 0);
    return !(world->inverse[key->a].mass > 0) &&
           world->walls[dem2di_wall_of(world, i)].desc.mode != DEM2D_WALL_SERVO;
}

/* Is there such a pair in the list? */
static bool dem2di_some_immovable(const dem2d_world *world) {
    const dem2di_list *list = &world->list;
    if (!world->plan.held) return false;
    for (int i = 0; i < list->count; i++)
        if (list->keys[i].a >= 0 && dem2di_immovable(world, i)) return true;
    return false;
}

/* Velocities of a particle in the step that was made. */
static dem2di_velocities dem2di_velocities_made(const dem2d_world *world, int slot) {
    return world->redirected && world->bodies[slot].redirected
               ? world->made[slot]
               : dem2di_velocities_of(&world->now[slot]);
}

/* Contact i in columns, those of the list or what they were before; false when it is apart. This is
   the one way in which all but the kernels of circles read contacts. */
static inline bool dem2di_contact_get(const dem2d_world *world, const dem2di_contacts *from, int i,
                                      dem2di_contact *contact) {
    const dem2di_list *list = &world->list;
    const dem2di_key *key = &list->keys[i];
    dem2di_arms *arms = &contact->arms;
    contact->normal.x = from->normal_x[i];
    contact->normal.y = from->normal_y[i];
    contact->depth = from->depth[i];
    contact->force = from->force[i];
    contact->shear = from->shear[i];
    arms->a_n = arms->a_t = arms->b_n = arms->b_t = 0;
    if (i >= list->discs) {
        *arms = from->arms[i - list->discs];
    } else if (contact->depth > 0) {
        arms->a_n = world->now[key->a].radius - contact->depth / 2;
        arms->b_n = -(world->now[key->b].radius - contact->depth / 2);
    }
    return contact->depth > 0;
}

/* Geometry of a contact into the columns of the list. Between two circles the arms follow from the
   rest. */
static inline void dem2di_geometry_put(dem2di_list *list, int i, const dem2di_contact *contact) {
    const dem2di_contacts *to = &list->contacts;
    to->normal_x[i] = contact->normal.x;
    to->normal_y[i] = contact->normal.y;
    to->depth[i] = contact->depth;
    if (i >= list->discs) to->arms[i - list->discs] = contact->arms;
}

/* The points of a contact that has two, else NULL. */
static const dem2di_point_pair *dem2di_point_pair_of(const dem2d_world *world,
                                                     const dem2di_contacts *from, int i) {
    if (!world->plan.faces || i < world->list.discs) return NULL;
    const dem2di_point_pair *pair = &from->point_pairs[i - world->list.discs];
    return dem2di_has_two_points(pair) ? pair : NULL;
}

/* Moment of a contact. */
static inline double dem2di_moment_of(const dem2d_world *world, const dem2di_contacts *from,
                                      int i) {
    return world->plan.terms & DEM2DI_ROLLING ? from->moment[i] : 0;
}

/* What the dashpot has of the normal force of a closed contact, or of its point k. With one point
   this is what the spring has not. */
static double dem2di_viscous_of(const dem2d_world *world, const dem2di_contacts *from, int i,
                                int k) {
    const int terms = world->plan.terms;
    if (!(terms & DEM2DI_DASHPOT) || (terms & DEM2DI_CALLERS_LAW)) return 0;
    if (dem2di_point_pair_of(world, from, i) != NULL)
        return from->point_viscous[i - world->list.discs].at[k];
    return k == 0 ? from->force[i] - dem2di_law_of(world, i)->normal_stiffness * from->depth[i] : 0;
}

/* Energy in the springs of a contact that is closed, by the law that its materials have now. */
static dem2di_stored dem2di_stored_in(const dem2d_world *world, const dem2di_contacts *from, int i,
                                      const dem2di_contact *contact) {
    const dem2d_pair_desc *law = dem2di_law_of(world, i);
    const dem2di_point_pair *pair = dem2di_point_pair_of(world, from, i);
    double kn = law->normal_stiffness, kt = law->tangential_stiffness;
    double moment = dem2di_moment_of(world, from, i);
    dem2di_stored stored = {0, 0, 0};
    if (world->law != NULL) {
        stored.normal = from->energy[i];
        return stored;
    }
    if (moment != 0 && kt > 0) {
        double kr = dem2di_rolling_stiffness(law, dem2di_reduced_radius(world, i));
        stored.rolling = moment * (moment / kr) / 2;
    }
    if (pair == NULL) {
        stored.normal = kn * contact->depth * contact->depth / 2;
        if (kt > 0) stored.tangential = contact->shear * (contact->shear / kt) / 2;
        return stored;
    }
    stored.normal = kn * pair->energy;
    for (int k = 0; k < 2 && kt > 0; k++) {
        double weight = pair->weight[k], shear = pair->shear[k];
        if (weight > 0) stored.tangential += shear * (shear / (weight * kt)) / 2;
    }
    return stored;
}

static void dem2di_stored_add(dem2di_stored *sum, dem2di_stored part, double factor) {
    sum->normal += factor * part.normal;
    sum->tangential += factor * part.tangential;
    sum->rolling += factor * part.rolling;
}

/* Sum of the contact forces on a particle at the last force pass, in the order of the step. */
static dem2di_load dem2di_load_of(const dem2d_world *world, int slot) {
    const dem2di_list *list = &world->list;
    dem2di_load sum = {{0, 0}, 0};
    for (int k = list->first[slot]; k < list->first[slot + 1]; k++) {
        int i = list->adjacent[k];
        bool is_b = k < list->own[slot];
        dem2di_contact contact;
        if (!dem2di_contact_get(world, &list->contacts, i, &contact)) continue;
        double moment = dem2di_moment_of(world, &list->contacts, i);
        dem2d_vec force = dem2di_contact_force(&contact);
        sum.force = dem2di_along(sum.force, is_b ? 1 : -1, force);
        sum.torque += is_b ? dem2di_torque_b(&contact, moment) : dem2di_torque_a(&contact, moment);
    }
    return sum;
}

/* The external load of a particle. */
static inline dem2di_load dem2di_external(const dem2d_world *world, int slot) {
    const dem2di_load none = {{0, 0}, 0};
    return world->loaded ? world->loads[slot] : none;
}

DEM2D_API dem2d_result dem2d_world_get_particle(const dem2d_world *world, dem2d_particle_id id,
                                                dem2d_particle_info *info) {
    if (world == NULL || info == NULL) return DEM2D_NULL_ARGUMENT;
    int slot = dem2di_slot(world, id);
    if (slot < 0) return dem2di_stale(world, "particle", id.index);
    const dem2di_body *body = &world->bodies[slot];
    const dem2di_state *now = &world->now[slot];
    info->shape.index = (uint32_t)body->shape_index;
    info->shape.generation = world->templates[body->shape_index].generation;
    info->material.index = (uint32_t)body->material;
    info->material.generation = 1;
    info->motion = (dem2d_motion)body->motion;
    info->pose = dem2di_pose_of(world, world->now, slot);
    info->velocity = now->v;
    info->angular_velocity = now->w;
    dem2di_load load = dem2di_load_of(world, slot);
    info->force = load.force;
    info->torque = load.torque;
    info->mass = dem2di_body_mass(world, body);
    info->inertia = dem2di_body_inertia(world, body);
    info->radius = now->radius;
    info->equivalent = dem2di_equivalent(world, slot);
    info->name = world->named ? world->names[slot] : 0;
    load = dem2di_external(world, slot);
    info->load = load.force;
    info->load_torque = load.torque;
    return DEM2D_OK;
}

/* A listed contact ends: in the next force pass the two were apart, and nothing is known of them.
 */
static void dem2di_contact_end(dem2d_world *world, int i) {
    const dem2di_list *list = &world->list;
    const dem2di_contacts *contacts = &list->contacts;
    contacts->normal_x[i] = contacts->normal_y[i] = 0;
    contacts->depth[i] = -1;
    dem2di_contact_clear(world, i);
    if (i < list->discs) return;
    memset(&contacts->history[i - list->discs], 0, sizeof *contacts->history);
}

/* A particle has been put elsewhere: all its contacts end, and as much of its skin is used up. */
static void dem2di_moved(dem2d_world *world, int slot, dem2d_vec way) {
    const dem2di_list *list = &world->list;
    world->check_due = world->ledger.edited = true;
    world->tree.made = false;
    if (world->list_stale) {
        dem2di_forget(world, slot);
        return;
    }
    for (int k = list->first[slot]; k < list->first[slot + 1]; k++)
        dem2di_contact_end(world, list->adjacent[k]);
    world->list_displacement += dem2di_length(way) * sqrt(world->inverse_skin_squared[slot]);
    world->list_stale = !(world->list_displacement <= 1 - DEM2DI_LIST_STEPS * DBL_EPSILON);
}

DEM2D_API dem2d_result dem2d_world_move_particle(dem2d_world *world, dem2d_particle_id id,
                                                 dem2d_vec position, double angle) {
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    int slot = dem2di_slot(world, id);
    if (slot < 0) return dem2di_stale(world, "particle", id.index);
    dem2d_particle_desc moved = dem2di_particle_plain();
    moved.position = position;
    moved.angle = angle;
    dem2d_result result = dem2di_check_motion(&world->env, &moved);
    if (result != DEM2D_OK) return result;
    dem2d_vec way = dem2di_sub(position, world->now[slot].x);
    world->now[slot].x = position;
    world->now[slot].q = dem2di_orientation(world, angle);
    world->before[slot] = world->now[slot];
    dem2di_moved(world, slot, way);
    return DEM2D_OK;
}

/* A particle gets other velocities: those of the step that was made are kept. */
static bool dem2di_redirect(dem2d_world *world, int slot, dem2d_vec v, double w) {
    const dem2di_state *now = &world->now[slot];
    bool same = v.x == now->v.x && v.y == now->v.y && w == now->w;
    if (same || world->bodies[slot].redirected) return true;
    if (!dem2di_group_reserve(world, DEM2DI_MADE, world->body_count)) return false;
    if (!world->redirected) /* of the others 0 */
        memset(world->made, 0, (size_t)world->body_count * sizeof *world->made);
    world->made[slot] = dem2di_velocities_of(&world->now[slot]);
    world->bodies[slot].redirected = world->redirected = true;
    return true;
}

/* Does it move by more than its inscribed radius in a step? Two of which neither does come to
   overlap before one's centre has passed the other's. */
static bool dem2di_outruns(const dem2d_world *world, int slot) {
    const dem2di_state *now = &world->now[slot];
    const dem2d_shape *shape = dem2di_shape_of(world, &world->bodies[slot]);
    double speed = dem2di_length(now->v), inner = shape->inscribed;
    if (!(inner > 0)) inner = shape->circumscribed; /* of a custom one it may be unknown */
    if (shape->type != DEM2D_CIRCLE) speed += fabs(now->w) * now->radius;
    return speed * world->time_step > inner * world->bodies[slot].scale;
}

/* May a velocity that was set change the features in use, or the bounds of the motion? */
static bool dem2di_speeds_matter(const dem2d_world *world, int slot) {
    const dem2di_state *now = &world->now[slot];
    return (now->w != 0 && !world->plan.spin) || dem2di_size_of(now->v) > DEM2DI_SPEED_SURE ||
           fabs(now->w) * world->time_step > DEM2DI_TURN_SURE;
}

/* Another kind of motion. Of a fixed particle not all pairs are listed. */
static void dem2di_set_motion(dem2d_world *world, int slot, dem2d_motion motion) {
    dem2di_body *body = &world->bodies[slot];
    if ((dem2d_motion)body->motion == motion) return;
    if ((dem2d_motion)body->motion == DEM2D_FIXED) world->list_stale = true;
    body->motion = (uint8_t)motion;
    world->inverse[slot] = dem2di_inverse_of(world, body);
    world->check_due = world->ledger.edited = true;
    dem2di_edited(world);
}

DEM2D_API dem2d_result dem2d_world_drive_particle(dem2d_world *world, dem2d_particle_id id,
                                                  dem2d_motion motion, dem2d_vec velocity,
                                                  double angular_velocity) {
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    int slot = dem2di_slot(world, id);
    if (slot < 0) return dem2di_stale(world, "particle", id.index);
    dem2d_particle_desc driven = dem2di_particle_plain();
    driven.motion = motion;
    driven.velocity = velocity;
    driven.angular_velocity = angular_velocity;
    dem2d_result result = dem2di_check_motion(&world->env, &driven);
    if (result != DEM2D_OK) return result;
    if (!dem2di_redirect(world, slot, velocity, angular_velocity))
        return dem2di_out_of_memory(world, "velocities");
    world->now[slot].v = velocity;
    world->now[slot].w = angular_velocity;
    if (world->bodies[slot].redirected) world->ledger.edited = true;
    if (dem2di_outruns(world, slot)) world->check_due = true;
    if (dem2di_speeds_matter(world, slot)) dem2di_edited(world);
    dem2di_set_motion(world, slot, motion);
    return DEM2D_OK;
}

/* Room for external loads, when the first comes. */
static bool dem2di_loads_begin(dem2d_world *world) {
    if (world->loaded) return true;
    if (!dem2di_group_reserve(world, DEM2DI_LOADS, world->body_count)) return false;
    memset(world->loads, 0, (size_t)world->body_count * sizeof *world->loads);
    return world->loaded = true;
}

/* External loads up to this may be set without a look at the bounds of the motion: N/m and N. */
#define DEM2DI_LOAD_SURE 1e20

static double dem2di_load_size(const dem2di_load *load) {
    return dem2di_size_of(load->force) + fabs(load->torque);
}

DEM2D_API dem2d_result dem2d_world_set_load(dem2d_world *world, dem2d_particle_id id,
                                            dem2d_vec force, double torque) {
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    int slot = dem2di_slot(world, id);
    if (slot < 0) return dem2di_stale(world, "particle", id.index);
    dem2d_result result = dem2di_check_vec(&world->env, "force", force);
    if (result == DEM2D_OK)
        result = dem2di_check_number(&world->env, "torque", torque, DEM2DI_FINITE);
    if (result != DEM2D_OK) return result;
    if (!dem2di_loads_begin(world)) return dem2di_out_of_memory(world, "external loads");
    world->loads[slot].force = force;
    world->loads[slot].torque = torque;
    bool turns = torque != 0 && !world->twisted;
    world->twisted = world->twisted || turns;
    if (turns || dem2di_load_size(&world->loads[slot]) > DEM2DI_LOAD_SURE) dem2di_edited(world);
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_set_gravity(dem2d_world *world, dem2d_vec gravity) {
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_one(&world->env, dem2di_world_fields,
                                           offsetof(dem2d_world_desc, gravity), &gravity);
    if (result != DEM2D_OK) return result;
    world->gravity = gravity;
    if (dem2di_size_of(gravity) > DEM2DI_SPEED_SURE) dem2di_edited(world);
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_set_damping(dem2d_world *world, double local, double global) {
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_one(&world->env, dem2di_world_fields,
                                           offsetof(dem2d_world_desc, local_damping), &local);
    if (result == DEM2D_OK)
        result = dem2di_check_one(&world->env, dem2di_world_fields,
                                  offsetof(dem2d_world_desc, global_damping), &global);
    if (result != DEM2D_OK) return result;
    world->local_damping = local;
    world->global_damping = global;
    return DEM2D_OK;
}

/* Of the steps done. */
static double dem2di_time(const dem2d_world *world) {
    return world->timed + (double)(world->steps - world->timed_at) * world->time_step;
}

DEM2D_API dem2d_result dem2d_world_set_time_step(dem2d_world *world, double time_step) {
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_one(&world->env, dem2di_world_fields,
                                           offsetof(dem2d_world_desc, time_step), &time_step);
    if (result != DEM2D_OK) return result;
    if (time_step == world->time_step) return DEM2D_OK;
    world->timed = dem2di_time(world);
    world->timed_at = world->steps;
    if (time_step > world->time_step) world->check_due = true;
    world->time_step = time_step;
    if (world->steps == 0) world->made_step = time_step;
    world->ledger.edited = true;
    dem2di_edited(world);
    return DEM2D_OK;
}

/* ============================================================================================
   >>walls  Walls: their descs, parts and places
   uses: config, math, memory, fields, shapes, world, objects
   ============================================================================================ */

static dem2d_result dem2di_check_spans(const dem2d_world *world, const dem2d_wall_desc *desc) {
    int given = 0;
    for (int i = 0; i < 2; i++) {
        if (desc->spans[i].generation == 0) continue;
        if (!dem2di_wall_lives(world, desc->spans[i]))
            return dem2di_stale(world, "wall in spans", desc->spans[i].index);
        given++;
    }
    if (given == 1)
        return dem2di_fail(&world->env, DEM2D_OUT_OF_RANGE, -1, "spans: one wall of two given");
    if (desc->mode == DEM2D_WALL_SERVO && given == 0 && !desc->segment)
        return dem2di_check_number(&world->env, "length", desc->length, DEM2DI_POSITIVE);
    return DEM2D_OK;
}

static dem2d_result dem2di_check_segment(const dem2d_world *world, const dem2d_wall_desc *desc) {
    const dem2d_env *env = &world->env;
    double length = dem2di_length(dem2di_sub(desc->end, desc->point));
    if (length > 0 && dem2di_finite(length)) return DEM2D_OK;
    return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "end: segment of length %g", length);
}

static dem2d_result dem2di_check_wall(const dem2d_world *world, const dem2d_wall_desc *desc) {
    const dem2d_env *env = &world->env;
    dem2d_vec unit;
    if (!dem2di_material_lives(world, desc->material))
        return dem2di_stale(world, "material", desc->material.index);
    dem2d_result result = dem2di_check_fields(env, DEM2DI_ALL(dem2di_wall_fields), desc);
    if (result == DEM2D_OK && desc->mode == DEM2D_WALL_SERVO)
        result = dem2di_check_number(env, "max_speed", desc->max_speed, DEM2DI_POSITIVE);
    if (result != DEM2D_OK) return result;
    if (desc->segment) result = dem2di_check_segment(world, desc);
    if (result != DEM2D_OK) return result;
    if (!desc->segment && !dem2di_unit(desc->normal, &unit))
        return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "normal is 0");
    return dem2di_check_spans(world, desc);
}

/* Does wall a come before b in the order of names, then of indices? */
static bool dem2di_wall_precedes(const dem2di_wall *walls, int a, int b) {
    return walls[a].desc.name < walls[b].desc.name ||
           (walls[a].desc.name == walls[b].desc.name && a < b);
}

/* A wall whose name is new, from its place so far to its place in the order of `count` walls. */
static void dem2di_wall_rank(dem2d_world *world, int slot, int count) {
    dem2di_wall *walls = world->walls;
    int place = walls[slot].rank, last = count - 1;
    for (int way = -1; way <= 1; way += 2)
        while (way < 0
                   ? place > 0 && dem2di_wall_precedes(walls, slot, walls[place - 1].placed)
                   : place < last && dem2di_wall_precedes(walls, walls[place + 1].placed, slot)) {
            walls[place].placed = walls[place + way].placed;
            walls[walls[place].placed].rank = place;
            place += way;
        }
    walls[place].placed = slot;
    walls[slot].rank = place;
}

/* A wall gets so many parts, for which there is room: those of the walls after it move, and with
   them the keys of their contacts. */
static void dem2di_parts_resize(dem2d_world *world, int slot, int count) {
    dem2di_wall *wall = &world->walls[slot];
    int end = wall->first + wall->count, more = count - wall->count;
    const dem2di_list *list = &world->list;
    if (more == 0) return;
    size_t moved = (size_t)(world->part_count - end);
    memmove(world->parts + end + more, world->parts + end, moved * sizeof *world->parts);
    memmove(world->surfaces + end + more, world->surfaces + end, moved * sizeof *world->surfaces);
    for (int i = list->pairs; i < list->count; i++)
        if (list->keys[i].b >= end) list->keys[i].b += more;
    wall->count = count;
    world->part_count += more;
    world->tree.made = false;
    for (int place = wall->rank + 1; place < world->wall_count; place++)
        world->walls[world->walls[place].placed].first += more;
}

/* Where a part is when its wall is in one of its states. */
static dem2di_surface dem2di_surface_of(const dem2d_world *world, const dem2di_wall_state *states,
                                        int part) {
    const dem2di_part *own = &world->parts[part];
    dem2di_surface surface;
    surface.point = dem2di_add(states[own->wall].point, own->start);
    surface.along = own->along;
    return surface;
}

/* The parts of a wall whose name is new to their places in the order of ranks, one by one; keys go
   with them. */
static void dem2di_parts_rank(dem2d_world *world, int slot) {
    dem2di_part *parts = world->parts;
    const dem2di_list *list = &world->list;
    dem2di_wall *wall = &world->walls[slot];
    int old = wall->first, first = 0;
    dem2di_wall_rank(world, slot, world->wall_count);
    for (int place = 0; place < world->wall_count; place++) {
        dem2di_wall *placed = &world->walls[world->walls[place].placed];
        placed->first = first;
        first += placed->count;
    }
    int by = wall->first - old, count = wall->count, low = by < 0 ? wall->first : old;
    int high = low + count + abs(by);
    for (int i = list->pairs; i < list->count && by != 0; i++) {
        int *part = &list->keys[i].b;
        if (*part < low || *part >= high) continue;
        *part += *part >= old && *part < old + count ? by : by < 0 ? count : -count;
    }
    for (int k = 0; k < count && by != 0; k++) { /* the last first, or the first last */
        int from = by > 0 ? old : old + count - 1, to = by > 0 ? high - 1 : low;
        const dem2di_part part = parts[from];
        memmove(parts + (by > 0 ? from : to + 1), parts + (by > 0 ? from + 1 : to),
                (size_t)abs(to - from) * sizeof *parts);
        parts[to] = part;
    }
    for (int k = low; k < high && by != 0; k++)
        world->surfaces[k] = dem2di_surface_of(world, world->wall_now, k);
}

/* The part of a wall that has one, by its desc with a normal of unit length; a segment's follows.
 */
static void dem2di_part_describe(dem2di_wall *wall, dem2di_part *part) {
    dem2d_vec chord = dem2di_sub(wall->desc.end, wall->desc.point), along;
    part->start = dem2di_vec(0, 0);
    part->extent = 0;
    if (wall->desc.segment) {
        (void)dem2di_unit(chord, &along);
        part->extent = dem2di_length(chord);
        wall->desc.normal = dem2di_perp(along);
    } else {
        along = dem2di_vec(wall->desc.normal.y, -wall->desc.normal.x);
    }
    part->along.c = along.x;
    part->along.s = along.y;
}

static void dem2di_surfaces_set(dem2d_world *world, int wall) {
    int first = world->walls[wall].first;
    world->tree.made = false;
    for (int k = first; k < first + world->walls[wall].count; k++)
        world->surfaces[k] = dem2di_surface_of(world, world->wall_now, k);
}

/* Out of the wall, towards the grains. */
static inline dem2d_vec dem2di_surface_normal(const dem2di_surface *surface) {
    return dem2di_vec(-surface->along.s, surface->along.c);
}

/* The end of a segment of a length. */
static dem2d_vec dem2di_surface_end(const dem2di_surface *surface, double extent) {
    return dem2di_along(surface->point, extent, dem2di_vec(surface->along.c, surface->along.s));
}

/* A checked description into a slot, for whose parts there is room; users of its spans are counted.
 */
static void dem2di_wall_place(dem2d_world *world, int slot, const dem2d_wall_desc *desc) {
    dem2di_wall *wall = &world->walls[slot];
    wall->desc = *desc;
    if (!desc->segment) (void)dem2di_unit(desc->normal, &wall->desc.normal);
    dem2di_parts_rank(world, slot);
    dem2di_parts_resize(world, slot, 1);
    world->parts[wall->first].wall = slot;
    dem2di_part_describe(wall, &world->parts[wall->first]);
    for (int i = 0; i < 2; i++) {
        wall->span[i] = desc->spans[i].generation != 0 ? (int)desc->spans[i].index : -1;
        if (wall->span[i] >= 0) world->walls[wall->span[i]].users++;
    }
    dem2di_wall_state *now = &world->wall_now[slot];
    now->point = desc->point; /* the velocity stays that of the step that was made */
    if (desc->mode != DEM2D_WALL_SERVO) {
        now->drift = 0;
        memset(&now->backing, 0, sizeof now->backing);
    }
    world->wall_before[slot] = *now;
    dem2di_surfaces_set(world, slot);
    world->ledger.edited = true;
}

/* The line that segments are made of, when the first comes. The log knows if there is no memory. */
static bool dem2di_line_make(dem2d_world *world, const dem2d_wall_desc *desc) {
    if (!desc->segment || world->line != NULL) return true;
    dem2d_shape *line = dem2di_shape_allocate(&world->env, DEM2D_POLYGON, 2, 2);
    if (line == NULL) return false;
    for (int k = 0; k < 2; k++) {
        line->corners[k] = dem2di_vec(k - 0.5, 0);
        line->tangents[k] = dem2di_vec(1 - 2 * k, 0);
    }
    line->flat = true;
    line->circumscribed = 0.5;
    world->line = line;
    return true;
}

static void dem2di_wall_unspan(dem2d_world *world, const dem2di_wall *wall) {
    for (int i = 0; i < 2; i++)
        if (wall->span[i] >= 0) world->walls[wall->span[i]].users--;
}

/* Contacts with a wall are forgotten. */
static void dem2di_forget_wall(dem2d_world *world, int wall) {
    dem2di_list *list = &world->list;
    for (int i = list->pairs; i < list->count; i++)
        if (dem2di_wall_of(world, i) == wall) dem2di_contact_forget(world, i);
    world->list_stale = true;
    world->ledger.edited = true;
}

/* How far a wall has moved, as far as contacts can tell. */
static double dem2di_wall_way(const dem2di_wall *wall, dem2d_vec moved) {
    return wall->desc.segment ? dem2di_length(moved) : fabs(dem2di_dot(moved, wall->desc.normal));
}

/* The list is built with a wall as it is now. */
static void dem2di_wall_listed(dem2d_world *world, int slot) {
    dem2di_wall *wall = &world->walls[slot];
    const dem2di_surface *surface = &world->surfaces[wall->first];
    wall->listed[0] = world->wall_now[slot].point;
    wall->listed[1] = dem2di_surface_end(surface, world->parts[wall->first].extent);
    wall->listed[2] = wall->desc.normal;
    wall->reshaped = false;
}

/* Bound of how far the distance of any particle from a wall has changed since the list was built,
   with the wall in one of its states: of a segment the greater way of its ends; of a half-plane
   that is turned, the change at the corners of the box that holds all particles. */
static double dem2di_wall_change(const dem2d_world *world, const dem2di_wall_state *states,
                                 int slot) {
    const dem2di_wall *wall = &world->walls[slot];
    const dem2d_box *box = &world->box;
    dem2d_vec moved = dem2di_sub(states[slot].point, wall->listed[0]);
    if (!wall->reshaped) return dem2di_wall_way(wall, moved);
    const dem2di_surface surface = dem2di_surface_of(world, states, wall->first);
    dem2d_vec end = dem2di_surface_end(&surface, world->parts[wall->first].extent);
    end = dem2di_sub(end, wall->listed[1]);
    if (wall->desc.segment) return dem2di_max(dem2di_length(moved), dem2di_length(end));
    dem2d_vec turned = dem2di_sub(wall->desc.normal, wall->listed[2]);
    double most = 0, way = dem2di_dot(moved, wall->desc.normal);
    for (int k = 0; k < 4; k++) {
        dem2d_vec corner =
            dem2di_vec(k & 1 ? box->upper.x : box->lower.x, k & 2 ? box->upper.y : box->lower.y);
        double change = dem2di_dot(dem2di_sub(corner, wall->listed[0]), turned) - way;
        most = dem2di_max(most, fabs(change));
    }
    return most;
}

DEM2D_API dem2d_result dem2d_world_add_wall(dem2d_world *world, const dem2d_wall_desc *desc,
                                            dem2d_wall_id *id) {
    if (world == NULL || desc == NULL || id == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_wall(world, desc);
    if (result != DEM2D_OK) return result;
    int slot = 0;
    while (slot < world->wall_count && world->walls[slot].alive) slot++;
    if (!dem2di_group_reserve(world, DEM2DI_WALLS, slot + 1) ||
        !dem2di_group_reserve(world, DEM2DI_PARTS, world->part_count + 1))
        return dem2di_out_of_memory(world, "a wall");
    if (!dem2di_line_make(world, desc)) return DEM2D_OUT_OF_MEMORY;
    dem2di_wall *wall = &world->walls[slot];
    uint32_t generation = wall->generation + 1;
    bool is_new = slot == world->wall_count;
    int rank = is_new ? slot : wall->rank, placed = is_new ? slot : wall->placed;
    dem2di_row_clear(world, DEM2DI_WALLS, DEM2DI_WALLS, slot);
    wall->alive = true;
    wall->generation = generation;
    wall->rank = rank;
    wall->placed = placed;
    world->wall_count += is_new;
    if (desc->mode == DEM2D_WALL_MOVING) world->wall_now[slot].velocity = desc->velocity;
    dem2di_wall_place(world, slot, desc);
    dem2di_wall_listed(world, slot);
    world->list_stale = world->check_due = true;
    dem2di_edited(world);
    id->index = (uint32_t)slot;
    id->generation = wall->generation;
    return DEM2D_OK;
}

/* Velocity of a wall from now on; a servo's until its forces are known. */
static dem2d_vec dem2di_wall_velocity(const dem2d_world *world, int wall) {
    const dem2d_wall_desc *desc = &world->walls[wall].desc;
    if (desc->mode == DEM2D_WALL_SERVO) return world->wall_now[wall].velocity;
    return desc->mode == DEM2D_WALL_MOVING ? desc->velocity : dem2di_vec(0, 0);
}

/* Distance of a point from a part; behind a half-plane negative. */
static double dem2di_part_distance(const dem2d_world *world, int part, dem2d_vec x) {
    const dem2di_surface *surface = &world->surfaces[part];
    double extent = world->parts[part].extent;
    dem2d_vec from = dem2di_sub(x, surface->point);
    if (!(extent > 0)) return dem2di_dot(from, dem2di_surface_normal(surface));
    dem2d_vec along = dem2di_vec(surface->along.c, surface->along.s);
    double place = dem2di_max(0, dem2di_min(extent, dem2di_dot(from, along)));
    return dem2di_length(dem2di_along(from, -place, along));
}

/* Ends this near are a joint, of the shorter segment; and a contact point is at one, of the radius:
   a gap that no grain can tell, far above the rounding of walls that move together. */
#define DEM2DI_JOINT 1e-6

/* The ends of two parts that are a joint: numbers of 0 (start) and 1 (end) in `which`; false when
   there is none. */
static bool dem2di_segments_meet(const dem2d_world *world, int a, int b, int which[2],
                                 dem2d_vec *at) {
    const int part[2] = {a, b};
    dem2d_vec end[2][2];
    for (int k = 0; k < 2; k++) {
        double extent = world->parts[part[k]].extent;
        if (!(extent > 0)) return false;
        end[k][0] = world->surfaces[part[k]].point;
        end[k][1] = dem2di_surface_end(&world->surfaces[part[k]], extent);
    }
    double near = DEM2DI_JOINT * dem2di_min(world->parts[a].extent, world->parts[b].extent);
    for (which[0] = 0; which[0] < 2; which[0]++)
        for (which[1] = 0; which[1] < 2; which[1]++) {
            *at = end[0][which[0]];
            if (dem2di_length(dem2di_sub(*at, end[1][which[1]])) <= near) return true;
        }
    return false;
}

/* Has a wall a segment that meets another, or may, when one of the two moves? */
static bool dem2di_may_join(const dem2d_world *world, int wall) {
    const dem2di_wall *own = &world->walls[wall];
    int which[2];
    dem2d_vec at;
    if (own->count > 1) return true;
    for (int i = 0; i < world->part_count && own->desc.segment; i++) {
        const dem2di_wall *other = &world->walls[world->parts[i].wall];
        if (other == own || !other->desc.segment) continue;
        bool still = other->desc.mode == DEM2D_WALL_STILL && own->desc.mode == DEM2D_WALL_STILL;
        if (!still || dem2di_segments_meet(world, own->first, i, which, &at)) return true;
    }
    return false;
}

/* May a wall that was set again change the features in use, or the bounds of the motion? */
static bool dem2di_wall_matters(const dem2d_world *world, const dem2di_wall *old, int slot) {
    const dem2d_wall_desc *desc = &world->walls[slot].desc;
    double speed = dem2di_size_of(desc->velocity) + desc->max_speed;
    return (!world->plan.joints && dem2di_may_join(world, slot)) || speed > DEM2DI_SPEED_SURE ||
           fabs(desc->stress) > fabs(old->desc.stress) || desc->length > old->desc.length;
}

DEM2D_API dem2d_result dem2d_world_set_wall(dem2d_world *world, dem2d_wall_id id,
                                            const dem2d_wall_desc *desc) {
    if (world == NULL || desc == NULL) return DEM2D_NULL_ARGUMENT;
    if (!dem2di_wall_lives(world, id)) return dem2di_stale(world, "wall", id.index);
    dem2d_result result = dem2di_check_wall(world, desc);
    if (result != DEM2D_OK) return result;
    if (!dem2di_line_make(world, desc)) return DEM2D_OUT_OF_MEMORY;
    dem2di_wall *wall = &world->walls[id.index];
    const dem2di_wall old = *wall;
    double extent = world->parts[wall->first].extent;
    if (old.desc.name != desc->name) world->list_stale = true; /* contacts go by the wall's rank */
    dem2di_wall_unspan(world, wall);
    dem2di_wall_place(world, (int)id.index, desc);
    dem2d_vec normal = wall->desc.normal;
    bool other_kind = old.desc.segment != desc->segment;
    wall->reshaped = old.reshaped || extent != world->parts[wall->first].extent ||
                     old.desc.normal.x != normal.x || old.desc.normal.y != normal.y;
    if (other_kind || !(dem2di_dot(old.desc.normal, normal) > 0))
        dem2di_forget_wall(world, (int)id.index);
    if (!(dem2di_wall_change(world, world->wall_now, (int)id.index) <= wall->skin))
        world->list_stale = true;
    if (other_kind || old.desc.material.index != desc->material.index) {
        world->check_due = true;
        dem2di_edited(world);
    }
    if (old.desc.mode != desc->mode || dem2di_wall_matters(world, &old, (int)id.index))
        dem2di_edited(world);
    if (desc->mode == DEM2D_WALL_SERVO && old.desc.mode != DEM2D_WALL_SERVO &&
        (world->plan.held || world->plan_due > 0))
        world->list_stale = true; /* fixed particles have pairs with servo walls alone */
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_remove_wall(dem2d_world *world, dem2d_wall_id id) {
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    if (!dem2di_wall_lives(world, id)) return dem2di_stale(world, "wall", id.index);
    dem2di_wall *wall = &world->walls[id.index];
    int self = (wall->span[0] == (int)id.index) + (wall->span[1] == (int)id.index);
    if (wall->users > self)
        return dem2di_fail(&world->env, DEM2D_IN_USE, (int)id.index, "wall in %d spans",
                           wall->users);
    dem2di_wall_unspan(world, wall);
    wall->alive = false;
    dem2di_forget_wall(world, (int)id.index);
    dem2di_parts_resize(world, (int)id.index, 0);
    dem2di_edited(world);
    return DEM2D_OK;
}

/* Length that carries a wall's stress: between its spans, or as given. */
static double dem2di_wall_length(const dem2d_world *world, const dem2di_wall_state *states, int i) {
    const dem2di_wall *wall = &world->walls[i];
    if (wall->span[0] < 0)
        return wall->desc.segment ? world->parts[wall->first].extent : wall->desc.length;
    dem2d_vec across = dem2di_sub(states[wall->span[1]].point, states[wall->span[0]].point);
    return fabs(dem2di_dot(across, world->walls[wall->span[0]].desc.normal));
}

DEM2D_API dem2d_result dem2d_world_get_wall(const dem2d_world *world, dem2d_wall_id id,
                                            dem2d_wall_info *info) {
    if (world == NULL || info == NULL) return DEM2D_NULL_ARGUMENT;
    if (!dem2di_wall_lives(world, id)) return dem2di_stale(world, "wall", id.index);
    const dem2di_wall *wall = &world->walls[id.index];
    const dem2di_wall_state *now = &world->wall_now[id.index];
    info->name = wall->desc.name;
    info->mode = wall->desc.mode;
    info->material = wall->desc.material;
    info->point = now->point;
    info->normal = wall->desc.normal;
    info->segment = wall->desc.segment;
    info->end = dem2di_surface_end(&world->surfaces[wall->first], world->parts[wall->first].extent);
    info->velocity = dem2di_wall_velocity(world, (int)id.index);
    info->force = now->force;
    info->length = dem2di_wall_length(world, world->wall_before, (int)id.index);
    info->stress = -dem2di_dot(now->force, wall->desc.normal);
    info->stress = info->length > 0 ? info->stress / info->length : 0;
    info->target = wall->desc.stress;
    return DEM2D_OK;
}

/* ============================================================================================
   >>list  The list of contacts: particles in the order of space, partners, what they remember
   uses: config, math, broad, law, motion, world, objects, walls
   ============================================================================================ */

/* Parallel work is cut into blocks of so many items: enough to pay for a call of the callback's,
   few enough to share 10,000 particles out evenly. Contacts of other shapes take ten times longer
   than those of circles. */
#define DEM2DI_BLOCK 256
#define DEM2DI_BLOCK_OTHERS 64

static int dem2di_blocks(int items, int block) {
    return items / block + (items % block > 0);
}

/* The end of a block that begins at `begin`. */
static int dem2di_block_end(int begin, int block, int items) {
    return items - begin < block ? items : begin + block;
}

/* All that takes time goes through here. A count of 1 is work that is not cut. */
static void dem2di_run(const dem2d_world *world, dem2d_phase phase, int count, dem2d_task_fn *task,
                       void *context) {
    if (count == 0) return;
    if (world->parallel_for == NULL)
        task(context, 0, count);
    else
        world->parallel_for(world->parallel_user, phase, count, task, context);
}

/* Scratch memory, cut up from its start: places to fit into, or NULL to count only. */
typedef struct dem2di_cutter {
    char *memory;
    size_t used;
} dem2di_cutter;

static void *dem2di_cut(dem2di_cutter *cutter, size_t count, size_t size) {
    size_t at = cutter->used;
    cutter->used += (count * size + DEM2DI_LINE - 1) / DEM2DI_LINE * DEM2DI_LINE;
    return cutter->memory != NULL ? cutter->memory + at : NULL;
}

static bool dem2di_scratch_reserve(dem2d_world *world, size_t bytes) {
    size_t lines = bytes / DEM2DI_LINE + (bytes % DEM2DI_LINE > 0);
    if (lines > (size_t)INT_MAX) return false;
    return dem2di_group_reserve(world, DEM2DI_SCRATCH, (int)lines);
}

static int dem2di_force_blocks(int discs, int count) {
    return dem2di_blocks(discs, DEM2DI_BLOCK) + dem2di_blocks(count - discs, DEM2DI_BLOCK_OTHERS);
}

/* Room for what the blocks find. */
static bool dem2di_block_results_reserve(dem2d_world *world, int discs, int count) {
    int blocks = dem2di_force_blocks(discs, count);
    int bodies = dem2di_blocks(world->body_count, DEM2DI_BLOCK);
    return dem2di_group_reserve(world, DEM2DI_BLOCK_RESULTS, blocks > bodies ? blocks : bodies);
}

/* --- the order of names ----------------------------------------------------------------------- */

/* Ranks of the particles and of the free ids: their places in the order. */
static void dem2di_ranks_set(dem2d_world *world) {
    for (int place = 0; place < world->id_count; place++) {
        int index = world->order[place].index, slot = world->ids[index].slot;
        world->order[index].rank = place;
        if (slot >= 0) world->bodies[slot].rank = place;
    }
}

/* All ids by names, those of one name by indices; free ids behind. */
static void dem2di_order_task(void *context, int begin, int end) {
    dem2d_world *world = (dem2d_world *)context;
    dem2di_cutter cutter = {world->scratch, 0};
    size_t room = (size_t)world->id_count;
    dem2di_order *items = (dem2di_order *)dem2di_cut(&cutter, room, sizeof *items);
    dem2di_order *spare = (dem2di_order *)dem2di_cut(&cutter, room, sizeof *spare);
    int count = 0, left = world->id_count;
    (void)begin;
    (void)end;
    for (int index = world->id_count - 1; index >= 0; index--)
        if (world->ids[index].slot < 0) world->order[--left].index = index;
    for (int index = 0; index < world->id_count; index++) {
        int slot = world->ids[index].slot;
        if (slot < 0) continue;
        items[count].key = world->names[slot];
        items[count++].value = index;
    }
    dem2di_sort(items, spare, count);
    for (int k = 0; k < count; k++) world->order[k].index = items[k].value;
    dem2di_ranks_set(world);
}

/* The order of names when particles have come. Those that were there keep their order. */
static bool dem2di_order_names(dem2d_world *world) {
    dem2di_cutter cutter = {NULL, 0};
    if (!world->order_due) return true;
    for (int k = 0; k < 2; k++)
        (void)dem2di_cut(&cutter, (size_t)world->id_count, sizeof(dem2di_order));
    if (!dem2di_scratch_reserve(world, cutter.used)) return false;
    dem2di_run(world, DEM2D_PHASE_LIST, 1, dem2di_order_task, world);
    world->order_due = false;
    return true;
}

/* --- the contacts of each particle ------------------------------------------------------------ */

/* What the contacts of a particle are sorted by: their partners' ranks, walls behind. */
static uint32_t dem2di_adjacency_rank(const dem2d_world *world, int slot, int contact) {
    const dem2di_key *key = &world->list.keys[contact];
    if (contact >= world->list.pairs) return ((uint32_t)1 << 30) + (uint32_t)key->b;
    return (uint32_t)world->bodies[key->a == slot ? key->b : key->a].rank;
}

/* Each particle's contacts in order, by Shell's sort (Ciura's gaps): most have a handful, one that
   is a hundred times larger than its neighbours has hundreds. */
static void dem2di_adjacency_sort_task(void *context, int begin, int end) {
    static const int gaps[] = {301, 132, 57, 23, 10, 4, 1};
    const dem2d_world *world = (const dem2d_world *)context;
    const dem2di_list *list = &world->list;
    int last = dem2di_block_end((end - 1) * DEM2DI_BLOCK, DEM2DI_BLOCK, world->body_count);
    for (int slot = begin * DEM2DI_BLOCK; slot < last; slot++) {
        int *run = list->adjacent + list->first[slot];
        int count = list->first[slot + 1] - list->first[slot], as_b = 0;
        for (int g = count > 10 ? 0 : 5; g < 7; g++) {
            for (int i = gaps[g]; i < count; i++) {
                int contact = run[i], k = i;
                uint32_t rank = dem2di_adjacency_rank(world, slot, contact);
                for (; k >= gaps[g] && dem2di_adjacency_rank(world, slot, run[k - gaps[g]]) > rank;
                     k -= gaps[g])
                    run[k] = run[k - gaps[g]];
                run[k] = contact;
            }
        }
        while (as_b < count && list->keys[run[as_b]].a != slot) as_b++;
        list->own[slot] = list->first[slot] + as_b;
    }
}

static void dem2di_adjacency_fill_task(void *context, int begin, int end) {
    dem2d_world *world = (dem2d_world *)context;
    dem2di_list *list = &world->list;
    int *first = list->first, *last = first + 1, slots = world->body_count;
    (void)begin;
    (void)end;
    memset(first, 0, ((size_t)slots + 1) * sizeof *first);
    for (int i = 0; i < list->count; i++) {
        if (list->keys[i].a < 0) continue;
        last[list->keys[i].a]++;
        if (i < list->pairs) last[list->keys[i].b]++;
    }
    (void)dem2di_starts(last, slots);
    for (int i = 0; i < list->count; i++) {
        if (list->keys[i].a < 0) continue;
        list->adjacent[last[list->keys[i].a]++] = i;
        if (i < list->pairs) list->adjacent[last[list->keys[i].b]++] = i;
    }
}

/* The contacts of each particle, for which there is room. */
static void dem2di_adjacency_make(dem2d_world *world) {
    dem2di_run(world, DEM2D_PHASE_LIST, 1, dem2di_adjacency_fill_task, world);
    dem2di_run(world, DEM2D_PHASE_LIST, dem2di_blocks(world->body_count, DEM2DI_BLOCK),
               dem2di_adjacency_sort_task, world);
}

/* Room for two entries of each pair and one of each contact with a wall. */
static bool dem2di_adjacency_reserve(dem2d_world *world, int pairs, int count) {
    return dem2di_group_reserve(world, DEM2DI_ADJACENCY, pairs + count);
}

/* --- particles in the order of space ---------------------------------------------------------- */

/* Places in memory from now on: of slot i to[i], -1 for a removed particle. Returns how many there
   are. */
static int dem2di_order_make(const dem2d_world *world, dem2di_order *items, dem2di_order *spare,
                             int *to) {
    dem2d_vec lower = dem2di_vec(0, 0), upper = lower;
    int count = 0;
    for (int i = 0; i < world->body_count; i++) {
        dem2d_vec x = world->now[i].x;
        to[i] = -1;
        if (world->bodies[i].shape_index < 0) continue;
        lower.x = count == 0 ? x.x : dem2di_min(lower.x, x.x);
        lower.y = count == 0 ? x.y : dem2di_min(lower.y, x.y);
        upper.x = count == 0 ? x.x : dem2di_max(upper.x, x.x);
        upper.y = count == 0 ? x.y : dem2di_max(upper.y, x.y);
        items[count++].value = i;
    }
    if (world->scattered) {
        double size = dem2di_max(upper.x - lower.x, upper.y - lower.y);
        for (int k = 0; k < count; k++)
            items[k].key = dem2di_curve_place(lower, size, world->now[items[k].value].x);
        dem2di_sort(items, spare, count);
    }
    for (int k = 0; k < count; k++) to[items[k].value] = k;
    return count;
}

static void dem2di_arrange_task(void *context, int begin, int end) {
    dem2d_world *w = (dem2d_world *)context;
    size_t slots = (size_t)w->body_count;
    dem2di_cutter cutter = {w->scratch, 0};
    int *to = (int *)dem2di_cut(&cutter, slots, sizeof *to);
    char *room = cutter.memory + cutter.used; /* over the sorted items, once they are done with */
    dem2di_order *items = (dem2di_order *)dem2di_cut(&cutter, slots, sizeof *items);
    dem2di_order *spare = (dem2di_order *)dem2di_cut(&cutter, slots, sizeof *spare);
    (void)begin;
    (void)end;
    int n = w->body_count, count = dem2di_order_make(w, items, spare, to);
    dem2di_columns_move(w, to, n, count, room);
    for (int i = 0; i < count; i++) w->ids[w->bodies[i].index].slot = i;
    for (int i = 0; i < w->list.count; i++) {
        dem2di_key *key = &w->list.keys[i];
        if (key->a < 0) continue;
        key->a = to[key->a];
        if (i < w->list.pairs) key->b = to[key->b];
    }
    w->body_count = count;
    w->holes = 0;
    w->tree.made = false;
}

/* Close the gaps that removed particles left, and sort the particles in space when partners are
   far from each other in memory. Nothing that a caller can see changes. */
static bool dem2di_arrange(dem2d_world *world) {
    if (world->holes == 0 && !world->scattered) return true;
    size_t slots = (size_t)world->body_count;
    dem2di_cutter cutter = {NULL, 0};
    size_t sorted = 2 * sizeof(dem2di_order), moved = dem2di_moved_size();
    (void)dem2di_cut(&cutter, slots, sizeof(int));
    (void)dem2di_cut(&cutter, slots, sorted > moved ? sorted : moved);
    (void)dem2di_cut(&cutter, 1, DEM2DI_LINE); /* each of the two sorted may end within a line */
    if (!dem2di_scratch_reserve(world, cutter.used)) return false;
    dem2di_run(world, DEM2D_PHASE_LIST, 1, dem2di_arrange_task, world);
    if (world->list.adjacent != NULL) dem2di_adjacency_make(world); /* there is no list at first */
    return true;
}

/* --- skins -------------------------------------------------------------------------------------
 */

/* A step costs B/n for the list, which lasts n steps and takes as long to build as B looks at a
   pair of circles apart, and 3.4 s looks for a skin of s radii: in a dense packing a particle's
   reach grows by the ring 2 pi 2R 2s R, with 0.84/(pi R^2) partners in it, half of them its own.
   With n = s/u, u being the speed at which skins are used up, the least is at
   s^2 = (B/3.4) u. */
#define DEM2DI_SKIN_COST 8.0 /* B about 30 for circles: 320 ns against 10; the least is flat */
#define DEM2DI_SKIN_LEAST (1.0 / 1024)
#define DEM2DI_SKIN_MOST 0.5

/* The skin for the next list, after one that was used up. */
static void dem2di_tune_skin(dem2d_world *world) {
    double steps = (double)(world->steps - world->listed_at);
    if (world->skin_fixed || !world->list_used_up || !(steps > 0)) return;
    double speed = world->skin / steps, best = sqrt(DEM2DI_SKIN_COST * speed);
    best = dem2di_max(world->skin / 2, dem2di_min(world->skin * 2, best));
    world->skin = dem2di_max(DEM2DI_SKIN_LEAST, dem2di_min(DEM2DI_SKIN_MOST, best));
    world->interval = world->skin / speed;
}

/* Skin of one particle or wall of a size: a fast one gets what it needs to last as long as the
   others, up to a quarter of its size. */
static double dem2di_skin_of(const dem2d_world *world, double size, dem2d_vec v) {
    double skin = size * world->skin;
    if (world->skin_fixed) return skin;
    double path = dem2di_length(v) * world->time_step * world->interval;
    return skin + dem2di_min(path, size / 4);
}

/* --- building ----------------------------------------------------------------------------------
 */

enum { DEM2DI_DISCS, DEM2DI_OTHERS, DEM2DI_WALL_CONTACTS, DEM2DI_KINDS };

/* A list that is being made. */
typedef struct dem2di_build {
    dem2d_world *world;
    dem2di_plan plan;
    dem2di_grid grid;
    int *count[DEM2DI_KINDS]; /* of each particle's finds; then where they go */
    int total[DEM2DI_KINDS];
    dem2di_key *keys;                    /* as in the list, */
    int *old;                            /* and its contact in the old list, or -1 */
    dem2di_order *wall_contacts, *spare; /* part, rank of particle; slot */
    char *column;                        /* room for a column of contacts, where the grid was */
    bool bounded, back; /* as in the world; whether the next step may look back on contacts */
    double softness;
} dem2di_build;

/* Do two circles take the kernel of circles? It knows friction and the closed form, and no more. */
static bool dem2di_has_disc_kernel(const dem2d_world *world, const dem2di_plan *plan) {
    return world->solver == DEM2D_CERTIFIED && !(plan->terms & DEM2DI_CALLERS_LAW);
}

/* Terms of the law for two materials, beside springs and friction. */
static int dem2di_terms_of(const dem2d_pair_desc *law) {
    return (law->damping_ratio > 0 ? DEM2DI_DASHPOT : 0) |
           (law->rolling_friction > 0 ? DEM2DI_ROLLING : 0);
}

/* The features in use. A term of the law that is no longer needed is still there in the first step
   after an edit: what contacts had of it in the last force pass must outlast a step that is
   refused. */
static dem2di_plan dem2di_plan_make(const dem2d_world *world) {
    dem2di_plan plan;
    memset(&plan, 0, sizeof plan);
    bool used[DEM2DI_MATERIALS_MAX] = {false}, met[DEM2DI_MATERIALS_MAX] = {false};
    int bodies = 0;
    plan.one_law = true;
    for (int i = 0; i < world->body_count; i++) {
        const dem2di_body *body = &world->bodies[i];
        if (body->shape_index < 0) continue;
        const dem2d_shape *shape = dem2di_shape_of(world, body);
        used[body->material] = true;
        if (bodies++ == 0) plan.material = body->material;
        plan.one_law = plan.one_law && body->material == plan.material;
        plan.held = plan.held || body->motion != DEM2D_FREE;
        plan.spin = plan.spin || world->now[i].w != 0;
        plan.turns = plan.turns || shape->type != DEM2D_CIRCLE;
        plan.faces = plan.faces || (shape->flat && world->faces == DEM2D_TWO_POINTS);
    }
    for (int j = 0; j < world->wall_count; j++) {
        if (!world->walls[j].alive) continue;
        met[world->walls[j].desc.material.index] = true;
        plan.joints = plan.joints || dem2di_may_join(world, j);
    }
    for (int a = 0; a < world->material_count; a++)
        for (int b = 0; b < world->material_count; b++) {
            const dem2d_pair_desc *law = dem2di_law(world, a, b);
            if (!used[a] || !(used[b] || met[b])) continue;
            plan.friction = plan.friction || law->friction > 0;
            plan.terms_now |= dem2di_terms_of(law);
        }
    if (world->law != NULL) plan.terms_now = DEM2DI_TERMS - 1;
    plan.terms_made = world->plan.terms_made;
    plan.terms = plan.terms_now | plan.terms_made;
    plan.faces = plan.faces && world->law == NULL;
    plan.turns = plan.turns || !dem2di_has_disc_kernel(world, &plan);
    plan.turns = plan.turns || (world->plan.turns && bodies > 0);
    plan.spin = plan.spin || plan.turns || plan.friction || world->gather != NULL || world->twisted;
    plan.spin = plan.spin || (plan.terms & DEM2DI_ROLLING);
    return plan;
}

/* May the list stay when the features in use change from those of one plan to another's? They have
   the same arrays and the same kinds of pairs. */
static bool dem2di_plan_fits(const dem2di_plan *one, const dem2di_plan *other) {
    return one->terms == other->terms && one->faces == other->faces && one->turns == other->turns;
}

static void dem2di_disc_task(void *context, int begin, int end) {
    dem2di_build *build = (dem2di_build *)context;
    dem2d_world *world = build->world;
    for (int block = begin; block < end; block++) {
        int first = block * DEM2DI_BLOCK;
        double largest = 0;
        for (int i = first; i < dem2di_block_end(first, DEM2DI_BLOCK, world->body_count); i++) {
            const dem2di_body *body = &world->bodies[i];
            dem2di_disc *disc = &build->grid.discs[i];
            double skin = dem2di_max(dem2di_skin_of(world, world->now[i].radius, world->now[i].v),
                                     DEM2DI_ROUNDOFF * world->now[i].radius);
            world->inverse_skin_squared[i] = 1 / (skin * skin);
            disc->centre = world->now[i].x;
            disc->reach = world->now[i].radius + skin;
            disc->fixed = body->motion == DEM2D_FIXED;
            disc->circle = dem2di_shape_of(world, body)->type == DEM2D_CIRCLE &&
                           dem2di_has_disc_kernel(world, &build->plan);
            largest = dem2di_max(largest, disc->reach);
        }
        world->block_results[block].most = largest;
    }
}

static void dem2di_place_task(void *context, int begin, int end) {
    const dem2di_build *build = (const dem2di_build *)context;
    int first = begin * DEM2DI_BLOCK;
    int last = dem2di_block_end((end - 1) * DEM2DI_BLOCK, DEM2DI_BLOCK, build->grid.count);
    dem2di_grid_place(&build->grid, first, last);
}

static void dem2di_grid_task(void *context, int begin, int end) {
    (void)begin;
    (void)end;
    dem2di_grid_sort(&((dem2di_build *)context)->grid);
}

/* Is a part of a wall within the skins of a particle, and may be a contact? A segment is within its
   length of its start, which rules out most without a root. */
static inline bool dem2di_part_is_near(const dem2d_world *world, const dem2di_disc *disc,
                                       int part) {
    const dem2di_wall *wall = &world->walls[world->parts[part].wall];
    double extent = world->parts[part].extent, reach = disc->reach + wall->skin;
    double far = reach + extent;
    if (disc->fixed && wall->desc.mode != DEM2D_WALL_SERVO) return false;
    dem2d_vec from = dem2di_sub(disc->centre, world->surfaces[part].point);
    if (extent > 0 && dem2di_dot(from, from) > far * far * (1 + DEM2DI_ROUNDOFF)) return false;
    return dem2di_part_distance(world, part, disc->centre) < reach;
}

static void dem2di_find_add(const dem2d_world *world, int slot, int part, dem2di_order *to,
                            int *count) {
    if (to != NULL) {
        to[*count].key = (uint64_t)part << 32 | (uint64_t)world->bodies[slot].rank;
        to[*count].value = slot;
    }
    (*count)++;
}

/* The parts of walls near a particle, and those that it had a contact with in the last force pass,
   wherever they are now: these stay listed for the queries. Counted, and written where there is
   room. */
static int dem2di_find_walls(const dem2d_world *world, const dem2di_disc *disc, int slot,
                             dem2di_order *to) {
    const dem2di_list *list = &world->list;
    int count = 0;
    for (int j = 0; j < world->part_count; j++)
        if (dem2di_part_is_near(world, disc, j)) dem2di_find_add(world, slot, j, to, &count);
    for (int k = list->first[slot]; k < list->first[slot + 1]; k++) {
        int contact = list->adjacent[k];
        if (contact < list->pairs || !(list->contacts.depth[contact] > 0)) continue;
        if (!dem2di_part_is_near(world, disc, list->keys[contact].b))
            dem2di_find_add(world, slot, list->keys[contact].b, to, &count);
    }
    return count;
}

/* The partners of a particle: those within both skins, and those that it was in contact with in the
   last force pass and has left since, which stay listed for the queries and the ledger. */
static void dem2di_find_partners(const dem2di_build *build, dem2di_finds *finds) {
    const dem2di_list *list = &build->world->list;
    const dem2di_disc *discs = build->grid.discs, *own = &discs[finds->own];
    dem2di_grid_partners(&build->grid, finds);
    for (int k = list->own[finds->own]; k < list->first[finds->own + 1]; k++) {
        int contact = list->adjacent[k], b = list->keys[contact].b;
        if (contact >= list->pairs || !(list->contacts.depth[contact] > 0)) continue;
        dem2d_vec d = dem2di_sub(discs[b].centre, own->centre);
        double both = own->reach + discs[b].reach;
        bool fixed = own->fixed && discs[b].fixed;
        if (!fixed && dem2di_dot(d, d) < both * both) continue; /* the grid has found it */
        dem2di_find_pair(finds, b, own->circle && discs[b].circle);
    }
}

static void dem2di_count_task(void *context, int begin, int end) {
    const dem2di_build *build = (const dem2di_build *)context;
    int last = dem2di_block_end((end - 1) * DEM2DI_BLOCK, DEM2DI_BLOCK, build->grid.count);
    for (int i = begin * DEM2DI_BLOCK; i < last; i++) {
        dem2di_finds finds = {i, {0, 0}, {NULL, NULL}};
        dem2di_find_partners(build, &finds);
        build->count[DEM2DI_DISCS][i] = finds.count[0];
        build->count[DEM2DI_OTHERS][i] = finds.count[1];
        build->count[DEM2DI_WALL_CONTACTS][i] =
            dem2di_find_walls(build->world, &build->grid.discs[i], i, NULL);
    }
}

/* The contact that two partners had in the old list, or -1. */
static int dem2di_listed(const dem2d_world *world, const dem2di_key *key, bool wall) {
    const dem2di_list *list = &world->list;
    for (int k = list->own[key->a]; k < list->first[key->a + 1]; k++) {
        int contact = list->adjacent[k];
        const dem2di_key *old = &list->keys[contact];
        if (old->a == key->a && old->b == key->b && (contact >= list->pairs) == wall)
            return contact;
    }
    return -1;
}

/* A column of contacts on its way from the old list to the new one. */
typedef struct dem2di_carry {
    const int *old; /* number in the old list, or -1 */
    const char *from;
    char *to;
    size_t size;
    int begin, old_begin, count; /* numbers of the first elements; of contacts in the new list */
} dem2di_carry;

static void dem2di_carry_task(void *context, int begin, int end) {
    const dem2di_carry *carry = (const dem2di_carry *)context;
    const size_t size = carry->size;
    int items = carry->count - carry->begin;
    int last = dem2di_block_end((end - 1) * DEM2DI_BLOCK, DEM2DI_BLOCK, items);
    for (int i = begin * DEM2DI_BLOCK; i < last; i++) {
        int old = carry->old[carry->begin + i];
        char *to = carry->to + (size_t)i * size;
        if (old >= carry->old_begin)
            memcpy(to, carry->from + (size_t)(old - carry->old_begin) * size, size);
        else
            memset(to, 0, size);
    }
}

/* The contacts of the old list to their places in the new one. Pairs that were not listed were
   apart: all zero. */
static void dem2di_carry_over(const dem2di_build *build, int discs, int count) {
    dem2d_world *world = build->world;
    const dem2di_list *list = &world->list;
    for (int k = 0; k < DEM2DI_COLUMNS; k++) {
        const dem2di_column *column = &dem2di_columns[k];
        if (!(column->treatment & DEM2DI_STORED)) continue;
        dem2di_carry carry;
        char *array = (char *)dem2di_column_get(world, column);
        carry.old = build->old;
        carry.from = array;
        carry.to = build->column;
        carry.size = column->size;
        carry.count = count;
        carry.begin = dem2di_contacts_begin(&build->plan, discs, count, column->group);
        carry.old_begin =
            dem2di_contacts_begin(&world->plan, list->discs, list->count, column->group);
        int items = count - carry.begin;
        dem2di_run(world, DEM2D_PHASE_LIST, dem2di_blocks(items, DEM2DI_BLOCK), dem2di_carry_task,
                   &carry);
        if (items > 0) memcpy(array, build->column, (size_t)items * column->size);
    }
}

/* Separation bounds of pairs count from here. */
static void dem2di_carry_others(const dem2di_build *build, int discs, int pairs) {
    dem2d_world *world = build->world;
    const dem2di_contacts *contacts = &world->list.contacts;
    for (int i = discs; i < pairs; i++) {
        const dem2di_key *key = &build->keys[i];
        if (world->plan.turns)
            contacts->history[i - discs].bound -=
                world->displacement[key->a] + world->displacement[key->b];
    }
}

static void dem2di_fill_task(void *context, int begin, int end) {
    const dem2di_build *build = (const dem2di_build *)context;
    const dem2d_world *world = build->world;
    const dem2di_body *bodies = world->bodies;
    for (int block = begin; block < end; block++) {
        int first = block * DEM2DI_BLOCK;
        int64_t spread = 0;
        for (int i = first; i < dem2di_block_end(first, DEM2DI_BLOCK, build->grid.count); i++) {
            dem2di_finds finds;
            finds.own = i;
            finds.to[0] = build->keys + build->count[DEM2DI_DISCS][i];
            finds.to[1] = build->keys + build->total[DEM2DI_DISCS] + build->count[DEM2DI_OTHERS][i];
            dem2di_find_partners(build, &finds);
            for (int kind = 0; kind < 2; kind++)
                for (int k = 0; k < finds.count[kind]; k++) {
                    dem2di_key *key = &finds.to[kind][k];
                    int a = key->a, b = key->b;
                    spread += a < b ? b - a : a - b;
                    bool turned = bodies[a].rank > bodies[b].rank;
                    key->a = turned ? b : a;
                    key->b = turned ? a : b;
                    build->old[key - build->keys] = dem2di_listed(world, key, false);
                }
            const int *walls = &build->count[DEM2DI_WALL_CONTACTS][i];
            if (*walls <
                (i + 1 < build->grid.count ? walls[1] : build->total[DEM2DI_WALL_CONTACTS]))
                (void)dem2di_find_walls(world, &build->grid.discs[i], i,
                                        build->wall_contacts + *walls);
        }
        world->block_results[block].spread = spread;
    }
}

/* Contacts with walls, in the order of the parts and of the particles' ranks. */
static void dem2di_wall_contacts_task(void *context, int begin, int end) {
    dem2di_build *build = (dem2di_build *)context;
    int count = build->total[DEM2DI_WALL_CONTACTS];
    int pairs = build->total[DEM2DI_DISCS] + build->total[DEM2DI_OTHERS];
    (void)begin;
    (void)end;
    dem2di_sort(build->wall_contacts, build->spare, count);
    for (int i = 0; i < count; i++) {
        build->keys[pairs + i].a = build->wall_contacts[i].value;
        build->keys[pairs + i].b = (int)(build->wall_contacts[i].key >> 32);
        build->old[pairs + i] = dem2di_listed(build->world, &build->keys[pairs + i], true);
    }
}

/* |p'| <= sqrt(R^2 - p^2) and p is at least the inscribed radius; of a circle p' is 0. */
static double dem2di_lever_of(const dem2d_world *world, int slot) {
    const dem2d_shape *shape = dem2di_shape_of(world, &world->bodies[slot]);
    double radius = world->now[slot].radius, inner = shape->inscribed * world->bodies[slot].scale;
    return shape->type == DEM2D_CIRCLE ? 0 : sqrt(radius * radius - inner * inner);
}

/* Travels count from here. */
static void dem2di_displacement_task(void *context, int begin, int end) {
    dem2d_world *world = (dem2d_world *)context;
    int last = dem2di_block_end((end - 1) * DEM2DI_BLOCK, DEM2DI_BLOCK, world->body_count);
    for (int i = begin * DEM2DI_BLOCK; i < last; i++) {
        world->displacement[i] = 0;
        world->lever[i] = dem2di_lever_of(world, i);
    }
}

/* Can no state become infinite before the next list? Particles and walls stay within their skins,
   so no overlap exceeds the scene, and no force its stiffness times that. With `steps` steps, this
   is true of any sane scene; where it is not, each step is tried before it is taken. Speeds and
   gravity up to these values may be set without asking again. */
static bool dem2di_bounded(const dem2d_world *world, const dem2di_plan *plan, int contacts) {
    double far = 0, size = 0, heavy = 0, light = 0, slender = 0, stiff = 0, ratio = 0, rolling = 0;
    double speed = DEM2DI_SPEED_SURE, spin = DEM2DI_TURN_SURE / world->time_step;
    double load = world->loaded ? DEM2DI_LOAD_SURE : 0;
    bool circles = true;
    for (int i = 0; i < world->body_count; i++) {
        const dem2di_state *now = &world->now[i];
        if (world->loaded) load = dem2di_max(load, dem2di_load_size(&world->loads[i]));
        far = dem2di_max(far, dem2di_size_of(now->x));
        speed = dem2di_max(speed, dem2di_size_of(now->v));
        spin = dem2di_max(spin, fabs(now->w));
        size = dem2di_max(size, now->radius);
        light = dem2di_max(light, world->inverse[i].mass);
        if (world->inverse[i].mass > 0) heavy = dem2di_max(heavy, 1 / world->inverse[i].mass);
        slender = dem2di_max(slender, world->inverse[i].inertia);
        circles = circles && dem2di_is_circle(world, i);
    }
    for (int j = 0; j < world->wall_count; j++) {
        const dem2d_wall_desc *wall = &world->walls[j].desc;
        far = dem2di_max(far, dem2di_size_of(world->wall_now[j].point));
        speed = dem2di_max(speed, dem2di_size_of(dem2di_wall_velocity(world, j)) + wall->max_speed);
        stiff = dem2di_max(stiff, fabs(wall->stress));
        heavy = dem2di_max(heavy, wall->length);
    }
    for (int k = 0; k < world->laws_side * world->laws_side; k++) {
        const dem2d_pair_desc *law = &world->laws[k];
        stiff = dem2di_max(stiff, law->normal_stiffness * (1 + law->friction));
        ratio = dem2di_max(ratio, law->damping_ratio * (1 + law->friction));
        rolling = dem2di_max(rolling, law->rolling_friction);
    }
    double depth = 2 * (far + 2 * size), time = DEM2DI_LIST_STEPS * world->time_step;
    double closing = 2 * (speed + depth / world->time_step),
           dashpot = 2 * ratio * sqrt(heavy * stiff);
    double force = (contacts + 1.0) * (stiff * depth + dashpot * closing); /* damping doubles */
    speed +=
        2 * time *
        (dem2di_max(DEM2DI_SPEED_SURE, dem2di_size_of(world->gravity)) + (force + load) * light);
    spin += 2 * time * ((force * 2 * size * (1 + rolling) + load) * slender);
    bool known = plan->terms == 0 || (circles && world->law == NULL);
    return far + time * speed < 1e300 && force * heavy < 1e300 &&
           spin * world->time_step < 1e50 && /* its cube is finite */
           known && world->solver == DEM2D_CERTIFIED;
}

/* How far the rounding of a position moves a particle in a step, and the box that holds all centres
   while the list lasts. */
static void dem2di_extent_set(dem2d_world *world) {
    double far = 0, size = 0, inverse = 0, skin = 0;
    dem2d_box *box = &world->box;
    for (int i = 0; i < world->body_count; i++) {
        dem2d_vec x = world->now[i].x;
        box->lower.x = i == 0 ? x.x : dem2di_min(box->lower.x, x.x);
        box->lower.y = i == 0 ? x.y : dem2di_min(box->lower.y, x.y);
        box->upper.x = i == 0 ? x.x : dem2di_max(box->upper.x, x.x);
        box->upper.y = i == 0 ? x.y : dem2di_max(box->upper.y, x.y);
        far = dem2di_max(far, dem2di_size_of(x));
        size = dem2di_max(size, world->now[i].radius);
        inverse = dem2di_max(inverse, world->inverse_skin_squared[i]);
        skin = dem2di_max(skin, 1 / sqrt(world->inverse_skin_squared[i]));
    }
    box->lower = dem2di_sub(box->lower, dem2di_vec(skin, skin));
    box->upper = dem2di_add(box->upper, dem2di_vec(skin, skin));
    world->rounding =
        2 * DBL_EPSILON * (far + size); /* half an ulp of both coordinates, and more */
    world->roundoff_displacement = world->rounding * sqrt(inverse);
}

/* No eigenvalue of a particle is above the sum of the traces of its contacts. Of two circles a
   contact's is at most 2 (kn + kt) (1/m + R^2/I) with the greater radius, as the contact point may
   lie outside of the smaller one; of a circle and a wall it is less. The greatest sum over kn + kt,
   infinite with other shapes. */
static double dem2di_softness_of(const dem2di_build *build, double *sums) {
    const dem2d_world *world = build->world;
    int pairs = build->total[DEM2DI_DISCS] + build->total[DEM2DI_OTHERS];
    double most = 0;
    if (build->total[DEM2DI_OTHERS] > 0 || build->plan.terms != 0 || build->plan.turns)
        return HUGE_VAL;
    for (int i = 0; i < world->body_count; i++) sums[i] = 0;
    for (int i = 0; i < pairs + build->total[DEM2DI_WALL_CONTACTS]; i++) {
        int partner[2];
        partner[0] = build->keys[i].a;
        partner[1] = i < pairs ? build->keys[i].b : partner[0];
        double radius = dem2di_max(world->now[partner[0]].radius, world->now[partner[1]].radius);
        for (int k = 0; k < (i < pairs ? 2 : 1); k++) {
            const dem2di_body *body = &world->bodies[partner[k]];
            sums[partner[k]] += 2 * (1 / dem2di_body_mass(world, body) +
                                     radius * radius / dem2di_body_inertia(world, body));
        }
    }
    for (int i = 0; i < world->body_count; i++) most = dem2di_max(most, sums[i]);
    return most;
}

/* Scratch memory of a step with so many contacts, or its size where there is none yet: `back` if it
   looks back on the last contacts. */
static size_t dem2di_step_cut(dem2d_world *world, char *memory, int discs, int pairs, int count,
                              const dem2di_plan *plan, bool back) {
    dem2di_cutter cutter = {memory, 0};
    double **loads[4];
    loads[0] = &world->load_x;
    loads[1] = &world->load_y;
    loads[2] = &world->load_a;
    loads[3] = &world->load_b;
    for (int k = 0; k < 4; k++)
        *loads[k] = (double *)dem2di_cut(&cutter, (size_t)count, sizeof(double));
    world->pushes =
        (dem2di_push *)dem2di_cut(&cutter, (size_t)(count - pairs), sizeof *world->pushes);
    for (int k = 0; k < DEM2DI_COLUMNS && back; k++) {
        const dem2di_column *column = &dem2di_columns[k];
        if (!(column->treatment & DEM2DI_STORED)) continue;
        int begin = dem2di_contacts_begin(plan, discs, count, column->group);
        dem2di_column last = dem2di_column_last(column);
        dem2di_column_set(world, &last, dem2di_cut(&cutter, (size_t)(count - begin), column->size));
    }
    return cutter.used;
}

/* No loads yet, in scratch memory that has room. */
static void dem2di_loads_clear(dem2d_world *world) {
    const dem2di_list *list = &world->list;
    (void)dem2di_step_cut(world, world->scratch, list->discs, list->pairs, list->count,
                          &world->plan, false);
    if (list->count > 0)
        memset(world->load_x, 0, (size_t)((char *)world->pushes - (char *)world->load_x));
}

/* Room for the contacts of the last force pass, which keeps them where it writes over them. */
static bool dem2di_keep_last(dem2d_world *world) {
    const dem2di_list *list = &world->list;
    size_t bytes =
        dem2di_step_cut(world, NULL, list->discs, list->pairs, list->count, &world->plan, true);
    bool room = dem2di_scratch_reserve(world, bytes);
    (void)dem2di_step_cut(world, world->scratch, list->discs, list->pairs, list->count,
                          &world->plan, room);
    return room;
}

/* A check takes as long as 0.7 (circles) to 1.4 steps (Fourier series), measured: with this many
   steps between two, less than 1 % of the time. */
#define DEM2DI_CHECK_STEPS 160

static bool dem2di_check_is_due(const dem2d_world *world) {
    return world->check_due || world->steps % DEM2DI_CHECK_STEPS == 0;
}

/* kn + kt of any two materials. */
static double dem2di_greatest_stiffness(const dem2d_world *world) {
    double greatest = 0;
    for (int a = 0; a < world->material_count; a++)
        for (int b = 0; b < world->material_count; b++) {
            const dem2d_pair_desc *law = dem2di_law(world, a, b);
            greatest = dem2di_max(greatest, law->normal_stiffness + law->tangential_stiffness);
        }
    return greatest;
}

/* Is the time step below the limit and the safe bound whatever the forces are? */
static bool dem2di_is_soft(const dem2d_world *world, double softness) {
    double square = world->time_step * world->time_step;
    return dem2di_greatest_stiffness(world) * softness * square <= 4;
}

/* May the next step look back on the contacts of the last force pass once those of its own are
   there? The ledger, joints and a caller's law do, and a step that may be refused: by the caller,
   for a time step that some particle may not stand, or a state that may become infinite. */
static bool dem2di_looks_back(const dem2d_world *world, const dem2di_plan *plan, bool bounded,
                              double softness) {
    bool soft = dem2di_is_soft(world, softness);
    bool checked = world->check_time_step && dem2di_check_is_due(world);
    return world->ledger.kept || plan->joints || world->law != NULL || !bounded ||
           world->gather != NULL || world->commit != NULL || (checked && !soft);
}

/* Scratch memory for the search and for what it finds. Contacts on their way come over the grid. */
static bool dem2di_build_cut(dem2di_build *build) {
    dem2d_world *world = build->world;
    size_t n = (size_t)build->grid.count, walls = (size_t)build->total[DEM2DI_WALL_CONTACTS];
    int discs = build->total[DEM2DI_DISCS], pairs = discs + build->total[DEM2DI_OTHERS];
    int count = pairs + build->total[DEM2DI_WALL_CONTACTS];
    for (int pass = 0; pass < 2; pass++) {
        dem2di_cutter cutter = {pass == 0 ? NULL : world->scratch, 0};
        dem2di_grid *grid = &build->grid;
        build->column = cutter.memory;
        grid->discs = (dem2di_disc *)dem2di_cut(&cutter, n, sizeof *grid->discs);
        grid->slot = (int *)dem2di_cut(&cutter, n, sizeof *grid->slot);
        grid->sorted = (int *)dem2di_cut(&cutter, n, sizeof *grid->sorted);
        grid->heads = (int *)dem2di_cut(&cutter, (size_t)grid->table + 1, sizeof *grid->heads);
        for (int kind = 0; kind < DEM2DI_KINDS; kind++)
            build->count[kind] = (int *)dem2di_cut(&cutter, n, sizeof(int));
        size_t column = dem2di_contacts_largest(&build->plan, discs, count);
        if (column > cutter.used) (void)dem2di_cut(&cutter, column - cutter.used, 1);
        build->keys = (dem2di_key *)dem2di_cut(&cutter, (size_t)count, sizeof *build->keys);
        build->old = (int *)dem2di_cut(&cutter, (size_t)count, sizeof *build->old);
        build->wall_contacts =
            (dem2di_order *)dem2di_cut(&cutter, walls, sizeof *build->wall_contacts);
        build->spare = (dem2di_order *)dem2di_cut(&cutter, walls, sizeof *build->spare);
        size_t step = dem2di_step_cut(world, NULL, discs, pairs, count, &build->plan, build->back);
        if (pass == 0 && !dem2di_scratch_reserve(world, cutter.used > step ? cutter.used : step))
            return false;
    }
    return true;
}

/* How many partners there are, and room for them. */
static bool dem2di_build_search(dem2di_build *build) {
    dem2d_world *world = build->world;
    int blocks = dem2di_blocks(world->body_count, DEM2DI_BLOCK);
    int64_t total = 0;
    build->grid.count = world->body_count;
    build->grid.table = dem2di_grid_table(world->body_count);
    if (!dem2di_build_cut(build)) return false;
    dem2di_run(world, DEM2D_PHASE_LIST, blocks, dem2di_disc_task, build);
    for (int k = 0; k < blocks; k++)
        build->grid.size = dem2di_max(build->grid.size, world->block_results[k].most * DEM2DI_CELL);
    if (world->body_count > 0) build->grid.origin = world->now[0].x;
    dem2di_run(world, DEM2D_PHASE_LIST, blocks, dem2di_place_task, build);
    dem2di_run(world, DEM2D_PHASE_LIST, 1, dem2di_grid_task, build);
    dem2di_run(world, DEM2D_PHASE_LIST, blocks, dem2di_count_task, build);
    for (int kind = 0; kind < DEM2DI_KINDS; kind++) {
        for (int i = 0; i < world->body_count; i++) total += build->count[kind][i];
        if (total > INT_MAX / 2) return false;
        build->total[kind] = dem2di_starts(build->count[kind], world->body_count);
    }
    if (!dem2di_build_cut(build)) return false;
    int discs = build->total[DEM2DI_DISCS];
    return dem2di_list_reserve(world, &build->plan, discs, (int)total) &&
           dem2di_adjacency_reserve(world, discs + build->total[DEM2DI_OTHERS], (int)total) &&
           dem2di_block_results_reserve(world, discs, (int)total);
}

/* Rotations for angles when the first particle that is no circle comes: what queries say stays the
   same to the last bit. There is no way back, but for a world that is empty. */
static void dem2di_reorient(dem2d_world *world, bool turns) {
    dem2di_state *states[2];
    states[0] = world->before;
    states[1] = world->now;
    world->plan.turns = turns;
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < world->body_count; i++)
            states[k][i].q = dem2di_orientation(world, states[k][i].q.c);
}

/* The found contacts become the list. */
static void dem2di_build_finish(dem2di_build *build) {
    dem2d_world *world = build->world;
    dem2di_list *list = &world->list;
    int discs = build->total[DEM2DI_DISCS], pairs = discs + build->total[DEM2DI_OTHERS];
    int count = pairs + build->total[DEM2DI_WALL_CONTACTS];
    dem2di_carry_over(build, discs, count);
    dem2di_carry_others(build, discs, pairs);
    list->discs = discs;
    list->pairs = pairs;
    list->count = count;
    if (count > 0) memcpy(list->keys, build->keys, (size_t)count * sizeof *list->keys);
    if (world->plan.turns != build->plan.turns) dem2di_reorient(world, build->plan.turns);
    world->plan = build->plan;
    world->immovable = dem2di_some_immovable(world);
    dem2di_loads_clear(world);
    dem2di_adjacency_make(world);
    if (world->plan.turns)
        dem2di_run(world, DEM2D_PHASE_LIST, dem2di_blocks(world->body_count, DEM2DI_BLOCK),
                   dem2di_displacement_task, world);
    dem2di_extent_set(world);
    world->bounded = build->bounded;
    world->softness = build->softness;
    for (int j = 0; j < world->wall_count; j++)
        if (world->walls[j].alive) dem2di_wall_listed(world, j);
    world->listed_at = world->steps;
    world->list_displacement = 0;
    world->list_stale = world->list_used_up = false;
}

/* Particles twice as far from their partners in memory as when they were last sorted are worth
   sorting again. */
static void dem2di_watch_spread(dem2d_world *world, bool sorted) {
    double sum = 0;
    for (int k = 0; k < dem2di_blocks(world->body_count, DEM2DI_BLOCK); k++)
        sum += (double)world->block_results[k].spread;
    double mean = world->list.pairs > 0 ? sum / world->list.pairs : 0;
    if (sorted) world->spread = mean;
    world->scattered = mean > 2 * world->spread;
}

static dem2d_result dem2di_list_failed(dem2d_world *world, double skin, double interval) {
    world->skin = skin;
    world->interval = interval;
    return dem2di_out_of_memory(world, "the list of contacts");
}

/* Renew the list. On failure the old one stays. */
static dem2d_result dem2di_build_list(dem2d_world *world, const dem2di_plan *plan) {
    dem2di_build build;
    memset(&build, 0, sizeof build);
    build.world = world;
    double skin = world->skin, interval = world->interval, largest = 0;
    bool sorted = world->scattered;
    bool room = dem2di_block_results_reserve(world, 0, 0) && dem2di_order_names(world) &&
                dem2di_arrange(world);
    if (room) {
        dem2di_tune_skin(world);
        for (int i = 0; i < world->body_count; i++)
            largest = dem2di_max(largest, world->now[i].radius);
        for (int j = 0; j < world->wall_count; j++)
            world->walls[j].skin = dem2di_skin_of(world, largest, dem2di_wall_velocity(world, j));
        build.plan = *plan;
        room = !build.plan.turns ||
               dem2di_group_reserve(world, DEM2DI_DISPLACEMENTS, world->body_count);
    }
    if (!room || !dem2di_build_search(&build)) return dem2di_list_failed(world, skin, interval);
    int blocks = dem2di_blocks(world->body_count, DEM2DI_BLOCK);
    dem2di_run(world, DEM2D_PHASE_LIST, blocks, dem2di_fill_task, &build);
    dem2di_run(world, DEM2D_PHASE_LIST, 1, dem2di_wall_contacts_task, &build);
    build.bounded = dem2di_bounded(world, &build.plan,
                                   build.total[DEM2DI_DISCS] + build.total[DEM2DI_OTHERS] +
                                       build.total[DEM2DI_WALL_CONTACTS]);
    build.softness = dem2di_softness_of(&build, (double *)(void *)world->scratch);
    build.back = dem2di_looks_back(world, &build.plan, build.bounded, build.softness);
    if (!dem2di_build_cut(&build)) return dem2di_list_failed(world, skin, interval);
    dem2di_build_finish(&build);
    dem2di_watch_spread(world, sorted);
    return DEM2D_OK;
}

/* What a step needs beforehand: the features in use, when an edit may have changed them, and the
   list, when it is used up or when arrays or kinds of pairs change. */
static dem2d_result dem2di_prepare(dem2d_world *world, bool *listed) {
    const dem2di_plan plan = world->plan_due > 0 ? dem2di_plan_make(world) : world->plan;
    *listed = world->list_stale || !dem2di_plan_fits(&plan, &world->plan);
    if (*listed) return dem2di_build_list(world, &plan);
    if (world->plan_due == 0) return DEM2D_OK;
    if (world->plan.friction && !plan.friction) dem2di_loads_clear(world); /* torques of circles */
    world->plan = plan;
    world->immovable = dem2di_some_immovable(world);
    world->bounded = dem2di_bounded(world, &plan, world->list.count);
    return DEM2D_OK;
}

/* ============================================================================================
   >>ledger  The ledger of energies: what is stored, and what went where in a step
   uses: config, math, broad, law, motion, world, objects
   ============================================================================================ */

/* How the two of a contact moved against each other in the step that was made: those who have been
   given other velocities since, by what they had then. */
static inline dem2di_relative_motion dem2di_motion_of(const dem2d_world *world, int contact) {
    const dem2di_key *key = &world->list.keys[contact];
    const bool wall = contact >= world->list.pairs;
    dem2d_vec a = world->now[key->a].v, b;
    dem2di_relative_motion motion;
    b = wall ? world->wall_now[dem2di_wall_of(world, contact)].velocity : world->now[key->b].v;
    motion.wa = world->now[key->a].w;
    motion.wb = wall ? 0 : world->now[key->b].w;
    if (world->redirected) {
        const dem2di_velocities made_a = dem2di_velocities_made(world, key->a);
        a = made_a.v;
        motion.wa = made_a.w;
        if (!wall) {
            const dem2di_velocities made_b = dem2di_velocities_made(world, key->b);
            b = made_b.v;
            motion.wb = made_b.w;
        }
    }
    motion.v = dem2di_sub(b, a);
    return motion;
}

/* What the dashpots of a contact take in the step between the last force pass and this, by their
   forces at one of the two, which act for half of it: each at its own point, whose approach the
   velocities and the contact then give. After the last pass no spring relaxes by more than its
   depth: the force ends where it opens. */
static double dem2di_dashpot_work(const dem2d_world *world, const dem2di_contacts *from, int i,
                                  double depth, double closing, double turning) {
    const dem2di_point_pair *pair = dem2di_point_pair_of(world, from, i);
    double work = 0;
    if (!(world->plan.terms & DEM2DI_DASHPOT)) return 0;
    for (int k = 0; k < (pair != NULL ? 2 : 1); k++) {
        double offset = pair != NULL ? pair->offset[k] : 0;
        double way = (closing + turning * offset) * world->made_step;
        if (pair != NULL) depth = pair->depth[k];
        if (from == &world->list.last) way = dem2di_max(-depth, way);
        work += dem2di_viscous_of(world, from, i, k) * way / 2;
    }
    return work;
}

/* One contact between the last force pass and this: forces act half at each, so that the energy
   they take is their mean times the way; where it opens or closes in between, the force of the one
   pass times the way by the contact's own geometry there. What sliding and rolling take is that
   less what the springs gained. */
static void dem2di_observe_contact(const dem2d_world *world, int i, dem2di_ledger *ledger) {
    const dem2di_contacts *pass[2]; /* the last, this */
    dem2di_stored gained = {0, 0, 0};
    bool closed[2];
    double slide = 0, shear = 0, moment = 0, force = 0, deeper = 0;
    const dem2di_relative_motion motion = dem2di_motion_of(world, i);
    const double turning = motion.wb - motion.wa;
    pass[0] = &world->list.last;
    pass[1] = &world->list.contacts;
    for (int k = 0; k < 2; k++) {
        dem2di_contact contact;
        closed[k] = dem2di_contact_get(world, pass[k], i, &contact);
        if (!closed[k]) continue;
        double closing = -dem2di_velocity_n(&contact, &motion);
        dem2di_stored stored = dem2di_stored_in(world, pass[k], i, &contact);
        if (k == 1) dem2di_stored_add(&ledger->stored, stored, 1);
        dem2di_stored_add(&gained, stored, k == 1 ? 1 : -1);
        slide += dem2di_velocity_t(&contact, &motion) * world->made_step;
        shear += contact.shear / 2;
        force += contact.force / 2;
        deeper += k == 1 ? contact.depth : -contact.depth;
        moment += dem2di_moment_of(world, pass[k], i) / 2;
        ledger->sum[DEM2DI_BY_DASHPOTS] +=
            dem2di_dashpot_work(world, pass[k], i, contact.depth, closing, turning);
    }
    if (closed[0] && closed[1]) slide /= 2;
    double taken = -(shear * slide + moment * turning * world->made_step);
    if (world->law != NULL) taken += force * deeper - gained.normal;
    ledger->sum[DEM2DI_BY_FRICTION] += taken - gained.tangential - gained.rolling;
}

/* All contacts in the order of ranks, before the motion. */
static void dem2di_observe_contacts(dem2d_world *world) {
    const dem2di_list *list = &world->list;
    memset(&world->ledger.stored, 0, sizeof world->ledger.stored);
    for (int place = 0; place < world->id_count; place++) {
        int slot = dem2di_slot_at(world, place);
        if (slot < 0) continue;
        for (int k = list->own[slot]; k < list->first[slot + 1]; k++)
            dem2di_observe_contact(world, list->adjacent[k], &world->ledger);
    }
}

/* Power on one particle in the first half of the step (0) and in the second, by accounts, and its
   kinetic energy. The new state is where the one of the last force pass was. */
static void dem2di_observe_particle(const dem2d_world *world, int slot, dem2di_load load,
                                    double power[2][DEM2DI_HALVES], double *kinetic) {
    const dem2di_body *body = &world->bodies[slot];
    const dem2di_state *old = &world->now[slot], *made = &world->before[slot];
    double mass = dem2di_body_mass(world, body), inertia = dem2di_body_inertia(world, body);
    bool is_free = body->motion == DEM2D_FREE;
    dem2d_vec weight = dem2di_scale(world->gravity, mass);
    dem2d_vec drag = dem2di_scale(dem2di_sub(made->v, old->v), mass / world->time_step);
    const dem2di_load external = dem2di_external(world, slot);
    drag = dem2di_sub(dem2di_sub(drag, dem2di_add(load.force, external.force)), weight);
    double brake = (made->w - old->w) * (inertia / world->time_step);
    brake -= load.torque + external.torque;
    for (int k = 0; k < 2; k++) {
        dem2di_velocities half =
            k == 0 ? dem2di_velocities_made(world, slot) : dem2di_velocities_of(made);
        double pushed = dem2di_dot(load.force, half.v) + load.torque * half.w;
        if (is_free) {
            power[k][DEM2DI_GRAVITY] += dem2di_dot(weight, half.v);
            power[k][DEM2DI_BY_LOADS] +=
                dem2di_dot(external.force, half.v) + external.torque * half.w;
            power[k][DEM2DI_BY_DAMPING] -= dem2di_dot(drag, half.v) + brake * half.w;
        } else {
            power[k][DEM2DI_DRIVING] -= pushed;
        }
    }
    if (is_free)
        *kinetic += mass * dem2di_dot(old->v, made->v) / 2 + inertia * old->w * made->w / 2;
}

/* What closes the ledger: stored and dissipated less what was put in. */
static double dem2di_ledger_error(const dem2di_ledger *ledger) {
    const double *sum = ledger->sum;
    const dem2di_stored *stored = &ledger->stored;
    return ledger->kinetic + stored->normal + stored->tangential + stored->rolling +
           sum[DEM2DI_BY_FRICTION] + sum[DEM2DI_BY_DASHPOTS] + sum[DEM2DI_BY_DAMPING] -
           sum[DEM2DI_GRAVITY] - sum[DEM2DI_BY_LOADS] - sum[DEM2DI_BY_WALLS] - sum[DEM2DI_DRIVING] -
           ledger->given;
}

/* What has gone from account to account since `last`. */
static double dem2di_ledger_turnover(const dem2di_ledger *ledger, const dem2di_ledger *last) {
    const dem2di_stored *stored = &ledger->stored, *before = &last->stored;
    double changes = fabs(ledger->kinetic - last->kinetic) + fabs(stored->normal - before->normal);
    changes += fabs(stored->tangential + stored->rolling - before->tangential - before->rolling);
    for (int k = 0; k < DEM2DI_ACCOUNTS; k++) changes += fabs(ledger->sum[k] - last->sum[k]);
    return changes / 2;
}

/* ============================================================================================
   >>step  Contacts, their sums, walls, motion; the stable time step
   uses: config, math, memory, fields, support, shapes, gjk, faces, contact, broad, law, motion,
         world, objects, walls, list, ledger
   ============================================================================================ */

/* Contacts of circles are taken in batches: what they need is fetched, all are computed by a loop
   that compilers turn into vector instructions, and the forces are put where they belong. There is
   no branch but for what the scene has: the force is 0 where two are apart, and with it the limit
   of the tangential spring. */
typedef struct dem2di_batch {
    double dx[DEM2DI_BATCH], dy[DEM2DI_BATCH]; /* from A to B */
    double radius_a[DEM2DI_BATCH], radius_b[DEM2DI_BATCH];
    double vx[DEM2DI_BATCH], vy[DEM2DI_BATCH]; /* of B against A */
    double wa[DEM2DI_BATCH], wb[DEM2DI_BATCH];
    double kn[DEM2DI_BATCH], kt[DEM2DI_BATCH], mu[DEM2DI_BATCH];
    double inverse[DEM2DI_BATCH]; /* 1/m, reduced */
    double zeta[DEM2DI_BATCH], mu_r[DEM2DI_BATCH];
    double normal_x[DEM2DI_BATCH], normal_y[DEM2DI_BATCH]; /* the last contact, then the next */
    double depth[DEM2DI_BATCH], force[DEM2DI_BATCH], shear[DEM2DI_BATCH], moment[DEM2DI_BATCH];
    double load_x[DEM2DI_BATCH], load_y[DEM2DI_BATCH], load_a[DEM2DI_BATCH], load_b[DEM2DI_BATCH];
} dem2di_batch;

static DEM2DI_INLINE void dem2di_batch_fetch(const dem2d_world *world, int first, int count,
                                             bool friction, int terms, bool one_law,
                                             dem2di_batch *batch) {
    const dem2di_key *keys = world->list.keys + first;
    for (int k = 0; k < count; k++) {
        const dem2di_state *a = &world->now[keys[k].a], *b = &world->now[keys[k].b];
        dem2d_vec d = dem2di_disc_line(a, b);
        DEM2DI_PREFETCH(a, DEM2DI_BATCH);
        DEM2DI_PREFETCH(b, DEM2DI_BATCH);
        batch->dx[k] = d.x;
        batch->dy[k] = d.y;
        batch->radius_a[k] = a->radius;
        batch->radius_b[k] = b->radius;
        if (terms)
            batch->inverse[k] = world->inverse[keys[k].a].mass + world->inverse[keys[k].b].mass;
        if (!one_law) {
            const dem2d_pair_desc *law = dem2di_law_of(world, first + k);
            batch->kn[k] = law->normal_stiffness;
            batch->kt[k] = law->tangential_stiffness;
            batch->mu[k] = law->friction;
            batch->zeta[k] = law->damping_ratio;
            batch->mu_r[k] = law->rolling_friction;
        }
        if (!friction) continue;
        batch->vx[k] = b->v.x - a->v.x;
        batch->vy[k] = b->v.y - a->v.y;
        batch->wa[k] = a->w;
        batch->wb[k] = b->w;
    }
}

/* Where somebody has been given other velocities since the step that was made: those of that. */
static void dem2di_batch_made(const dem2d_world *world, int first, int count, dem2di_batch *batch) {
    for (int k = 0; k < count; k++) {
        dem2di_relative_motion motion = dem2di_motion_of(world, first + k);
        batch->vx[k] = motion.v.x;
        batch->vy[k] = motion.v.y;
        batch->wa[k] = motion.wa;
        batch->wb[k] = motion.wb;
    }
}

/* Circles that no force moves against each other are apart: with radii of 0. */
static void dem2di_batch_hold(const dem2d_world *world, int first, int count, dem2di_batch *batch) {
    for (int k = 0; k < count; k++)
        if (dem2di_immovable(world, first + k)) batch->radius_a[k] = batch->radius_b[k] = 0;
}

DEM2DI_VECTORS_BEGIN
/* dem2di_slip for two circles. */
static DEM2DI_INLINE double dem2di_batch_slip(const dem2di_batch *batch, int k,
                                              const dem2di_round *now) {
    double vx = batch->vx[k], vy = batch->vy[k], wa = batch->wa[k], wb = batch->wb[k];
    double depth = batch->depth[k], closed = depth > 0 ? 1 : 0; /* no branch: for vectors */
    double arm_a = batch->radius_a[k] - depth / 2, arm_b = batch->radius_b[k] - depth / 2;
    double slip = now->normal.x * vy - now->normal.y * vx - (now->arm_a * wa + now->arm_b * wb);
    double before = batch->normal_x[k] * vy - batch->normal_y[k] * vx - (arm_a * wa + arm_b * wb);
    return slip + (before - slip) * (closed / 2);
}

/* The law of two circles, as dem2di_law_points and dem2di_law_rolling, for all of a batch: the next
   contacts over the last. Where two are apart the force is 0, and with it all that it limits. */
static DEM2DI_INLINE void dem2di_batch_loop(dem2di_batch *batch, int count, double time_step,
                                            const dem2d_pair_desc *law, bool friction, int terms,
                                            bool one_law) {
    for (int k = 0; k < count; k++) {
        const double kn = one_law ? law->normal_stiffness : batch->kn[k];
        const double kt = one_law ? law->tangential_stiffness : batch->kt[k];
        const double mu = one_law ? law->friction : batch->mu[k];
        dem2d_vec d;
        d.x = batch->dx[k];
        d.y = batch->dy[k];
        dem2di_round r = dem2di_round_make(d, batch->radius_a[k], batch->radius_b[k], kn);
        if (terms & DEM2DI_DASHPOT) {
            double zeta = one_law ? law->damping_ratio : batch->zeta[k];
            double approach = -(r.normal.x * batch->vx[k] + r.normal.y * batch->vy[k]);
            double dashpot = 2 * zeta * sqrt(1 / batch->inverse[k] * kn);
            double damped = dem2di_damped(r.force, dashpot, approach);
            r.force = r.depth > 0 ? damped : 0;
        }
        double x = r.normal.x * r.force, y = r.normal.y * r.force;
        if (friction) {
            double slip = dem2di_batch_slip(batch, k, &r);
            double spring = batch->shear[k] - kt * slip * time_step;
            spring = dem2di_held(mu * r.force, spring);
            x -= r.normal.y * spring;
            y += r.normal.x * spring;
            batch->shear[k] = spring;
            batch->load_a[k] = -(r.arm_a * spring);
            batch->load_b[k] = -(r.arm_b * spring);
        }
        if (terms & DEM2DI_ROLLING) {
            double radius_a = batch->radius_a[k], radius_b = batch->radius_b[k];
            double radius = radius_a * (radius_b / (radius_a + radius_b));
            double limit = (one_law ? law->rolling_friction : batch->mu_r[k]) * radius * r.force;
            double spin = batch->wb[k] - batch->wa[k];
            double moment = batch->moment[k] - kt * radius * radius * spin * time_step;
            moment = r.depth > 0 ? dem2di_held(limit, moment) : 0;
            batch->moment[k] = moment;
            batch->load_a[k] -= moment;
            batch->load_b[k] += moment;
        }
        batch->normal_x[k] = r.normal.x;
        batch->normal_y[k] = r.normal.y;
        batch->depth[k] = r.depth;
        batch->force[k] = r.force;
        batch->load_x[k] = x;
        batch->load_y[k] = y;
    }
}

/* What the scene has, as constants: to(friction, terms) for pairs of circles. Terms are taken with
   friction, and rolling with dashpots, which may be 0. */
#define DEM2DI_BATCH_CASES(plan, to)                                                   \
    ((plan)->terms == 0                ? (plan)->friction ? to(true, 0) : to(false, 0) \
                    : (plan)->terms == DEM2DI_DASHPOT ? to(true, DEM2DI_DASHPOT)       \
                                       : to(true, DEM2DI_DASHPOT | DEM2DI_ROLLING))

/* The loop for what the scene has. */
static void dem2di_batch_solve(dem2di_batch *batch, int count, double time_step,
                               const dem2d_pair_desc *law, const dem2di_plan *plan) {
#define DEM2DI_SOLVE(friction, terms)                                                       \
    (plan->one_law ? dem2di_batch_loop(batch, count, time_step, law, friction, terms, true) \
                   : dem2di_batch_loop(batch, count, time_step, law, friction, terms, false))
    DEM2DI_BATCH_CASES(plan, DEM2DI_SOLVE);
#undef DEM2DI_SOLVE
}
DEM2DI_VECTORS_END

/* The last contacts of a batch from the columns. */
static DEM2DI_INLINE void dem2di_batch_get(const dem2d_world *world, int first, int count,
                                           int terms, dem2di_batch *batch) {
    const dem2di_contacts *from = &world->list.contacts;
    const size_t bytes = (size_t)count * sizeof(double);
    memcpy(batch->normal_x, from->normal_x + first, bytes);
    memcpy(batch->normal_y, from->normal_y + first, bytes);
    memcpy(batch->depth, from->depth + first, bytes);
    memcpy(batch->shear, from->shear + first, bytes);
    if (terms & DEM2DI_ROLLING) memcpy(batch->moment, from->moment + first, bytes);
}

/* The next contacts and their loads into the columns. */
static DEM2DI_INLINE void dem2di_batch_put(dem2d_world *world, int first, int count, bool friction,
                                           int terms, const dem2di_batch *batch) {
    const dem2di_contacts *to = &world->list.contacts;
    const size_t bytes = (size_t)count * sizeof(double);
    memcpy(to->normal_x + first, batch->normal_x, bytes);
    memcpy(to->normal_y + first, batch->normal_y, bytes);
    memcpy(to->depth + first, batch->depth, bytes);
    memcpy(to->force + first, batch->force, bytes);
    memcpy(world->load_x + first, batch->load_x, bytes);
    memcpy(world->load_y + first, batch->load_y, bytes);
    if (!friction) {
        memset(to->shear + first, 0, bytes);
        return;
    }
    memcpy(to->shear + first, batch->shear, bytes);
    memcpy(world->load_a + first, batch->load_a, bytes);
    memcpy(world->load_b + first, batch->load_b, bytes);
    if (terms & DEM2DI_ROLLING) memcpy(to->moment + first, batch->moment, bytes);
}

/* Loads that are not finite, and the greatest. */
static void dem2di_batch_check(const dem2di_batch *batch, int n, bool friction,
                               dem2di_count *count) {
    for (int k = 0; k < n; k++) {
        double sum = fabs(batch->load_x[k]) + fabs(batch->load_y[k]);
        if (friction) sum += fabs(batch->load_a[k]) + fabs(batch->load_b[k]);
        count->unsound += !dem2di_finite(sum);
        count->load = dem2di_max(count->load, sum);
    }
}

static DEM2DI_INLINE void dem2di_disc_batch(dem2d_world *world, int first, int n, bool friction,
                                            int terms, bool one_law, dem2di_count *count) {
    const dem2di_plan *plan = &world->plan;
    dem2di_batch batch;
    int closed = 0;
    if (friction) dem2di_batch_get(world, first, n, terms & plan->terms, &batch);
    dem2di_batch_fetch(world, first, n, friction, terms, one_law, &batch);
    if (friction && world->redirected) dem2di_batch_made(world, first, n, &batch);
    if (world->immovable) dem2di_batch_hold(world, first, n, &batch);
    dem2di_batch_solve(&batch, n, world->made_step,
                       dem2di_law(world, plan->material, plan->material), plan);
    dem2di_batch_put(world, first, n, friction, terms & plan->terms, &batch);
    if (!world->bounded) dem2di_batch_check(&batch, n, friction, count);
    for (int k = 0; k < n; k++) closed += batch.depth[k] > 0;
    count->collisions += closed;
    count->proofs[DEM2D_BY_FORM] += closed;
}

static void dem2di_disc_range(dem2d_world *world, int begin, int end, dem2di_count *count) {
    const dem2di_plan *plan = &world->plan;
    for (int first = begin; first < end; first += DEM2DI_BATCH) {
        int n = dem2di_block_end(first, DEM2DI_BATCH, end) - first;
#define DEM2DI_DISCS_OF(friction, terms)                                              \
    (plan->one_law ? dem2di_disc_batch(world, first, n, friction, terms, true, count) \
                   : dem2di_disc_batch(world, first, n, friction, terms, false, count))
        DEM2DI_BATCH_CASES(plan, DEM2DI_DISCS_OF);
#undef DEM2DI_DISCS_OF
    }
}

/* Part of a gap that proves nothing: nearer to each other than this (m), two shapes may be found in
   contact by one search and apart by another. */
static double dem2di_gap_unsure(const dem2d_world *world, double size) {
    return (dem2di_max(world->tolerance, DEM2DI_ROUNDOFF) + DEM2DI_ROUNDOFF) * size;
}

/* Separation bound of a pair that is apart by a gap (m): until the accumulated displacements of
   both particles reach it, any search would find them apart. GJK and EPA take every pair anew, as
   in the papers. */
static double dem2di_separation_bound(const dem2d_world *world, int a, int b, double gap,
                                      double size) {
    if (world->solver == DEM2D_GJK_EPA) return 0;
    return world->displacement[a] + world->displacement[b] + (gap - dem2di_gap_unsure(world, size));
}

/* The search of one pair that nothing is known of, from the line of centres. */
static void dem2di_pair_search_anew(const dem2d_world *world, dem2di_pair *pair,
                                    dem2di_search *search) {
    dem2di_contact_solve(pair, world->solver, NULL, dem2di_centres(pair), world->tolerance,
                         world->max_iterations, true, search);
}

/* The search of one pair. A contact goes on from its own last normal and feature. Other pairs start
   from the line of centres, so that the result does not depend on when the pair was listed or
   collided before. Such a pair may first try what the last collision found, but only to prove a
   gap. */
static DEM2DI_INLINE void dem2di_pair_search(const dem2d_world *world, dem2di_pair *pair,
                                             const dem2di_contact *last,
                                             const dem2di_feature *feature, dem2di_search *search) {
    bool known = last->normal.x != 0 || last->normal.y != 0;
    pair->calls = 0;
    if (known && world->solver != DEM2D_GJK_EPA) {
        dem2di_contact_solve(pair, DEM2D_CERTIFIED, feature, last->normal, world->tolerance,
                             world->max_iterations, true, search);
        if (last->depth >= 0 || -search->upper > dem2di_gap_unsure(world, pair->size)) return;
    }
    dem2di_pair_search_anew(world, pair, search);
}

/* A look at two shapes from the contact's normal and history on: its normal, depth and points, or
   their gap. Returns the number of points that carry the contact. */
static int dem2di_collide_shapes(const dem2d_world *world, dem2di_pair *pair,
                                 const dem2di_contact *last, dem2di_history *history,
                                 dem2di_contact *contact, dem2d_contact_point points[2],
                                 double *gap, dem2di_count *count) {
    dem2di_search search;
    count->collisions++;
    dem2di_pair_search(world, pair, last, &history->feature, &search);
    count->calls += pair->calls;
    contact->normal.x = search.normal.x; /* not as one: it has just been stored in two */
    contact->normal.y = search.normal.y;
    history->feature = search.feature;
    if (!(search.upper > 0)) {
        count->separations++;
        *gap = -search.upper;
        return 0;
    }
    count->proofs[search.proof]++;
    contact->depth = search.upper;
    if (world->plan.faces && !search.alone) return dem2di_pair_points(pair, &search, points);
    points[0].position.x = (search.a.x + (search.b.x + pair->d.x)) * 0.5;
    points[0].position.y = (search.a.y + (search.b.y + pair->d.y)) * 0.5;
    return 1;
}

/* Two circles that overlap, among the others for the full law. */
static int dem2di_collide_circles(const dem2di_state *a, const dem2di_state *b,
                                  dem2di_contact *contact, dem2d_contact_point points[2],
                                  dem2di_count *count) {
    dem2di_round round = dem2di_round_make(dem2di_disc_line(a, b), a->radius, b->radius, 1);
    contact->normal = round.normal;
    contact->depth = round.depth;
    points[0].position = dem2di_vec(0, 0); /* what circles have follows from the depth */
    count->collisions++;
    count->proofs[DEM2D_BY_FORM]++;
    return round.depth > 0;
}

/* Geometry of one pair at the present positions. Returns the number of points that carry the
   contact, 0 when it is apart. */
static int dem2di_collide_pair(const dem2d_world *world, int a, int b, const dem2di_contact *last,
                               dem2di_history *history, dem2di_contact *contact,
                               dem2d_contact_point points[2], dem2di_count *count) {
    const dem2di_body *body_a = &world->bodies[a], *body_b = &world->bodies[b];
    const dem2di_state *state_a = &world->now[a], *state_b = &world->now[b];
    dem2d_vec d = dem2di_centre_line(state_a->x, state_b->x);
    double reach = state_a->radius + state_b->radius, distance = dem2di_length(d);
    history->bound = 0;
    if (distance >= reach) {
        history->bound = dem2di_separation_bound(world, a, b, distance - reach, distance + reach);
        return 0;
    }
    dem2di_pair pair;
    pair.a = dem2di_shape_of(world, body_a);
    pair.b = dem2di_shape_of(world, body_b);
    if (pair.a->type == DEM2D_CIRCLE && pair.b->type == DEM2D_CIRCLE &&
        world->solver != DEM2D_GJK_EPA)
        return dem2di_collide_circles(state_a, state_b, contact, points, count);
    pair.ra = state_a->q;
    pair.rb = state_b->q;
    pair.scale_a = body_a->scale;
    pair.scale_b = body_b->scale;
    pair.d = d;
    pair.distance = distance;
    pair.size = reach + distance;
    double gap;
    int found = dem2di_collide_shapes(world, &pair, last, history, contact, points, &gap, count);
    if (found == 0) history->bound = dem2di_separation_bound(world, a, b, gap, pair.size);
    return found;
}

/* What contact i was in the last force pass, before its geometry is written over. Its springs may
   be those of another contact that it took over from, across a joint of segments. */
typedef struct dem2di_last {
    const dem2di_contacts *from; /* columns with the forces of the last force pass, */
    int at;                      /* and the contact there */
    dem2di_contact contact;
    dem2di_point_pair pair; /* where contacts may have two points */
} dem2di_last;

static inline void dem2di_last_get(const dem2d_world *world, const dem2di_contacts *from, int i,
                                   dem2di_last *last) {
    int at = i - world->list.discs;
    last->from = from;
    last->at = i;
    last->contact.normal.x = from->normal_x[i];
    last->contact.normal.y = from->normal_y[i];
    last->contact.depth = from->depth[i];
    last->contact.shear = from->shear[i];
    last->contact.arms = from->arms[at];
    if (world->plan.faces) last->pair = from->point_pairs[at];
}

/* Terms of the law beside springs and friction, of the rows from first to before the end. */
static void dem2di_law_add_terms(const dem2d_world *world, int i, const dem2di_last *last,
                                 const dem2di_contact *contact,
                                 const dem2di_relative_motion *motion, int first,
                                 dem2di_law_rows *rows) {
    const dem2d_pair_desc *law = dem2di_law_of(world, i);
    const double inverse = dem2di_reduced_inverse(world, i), spin = motion->wb - motion->wa;
    const double approach = -dem2di_velocity_n(contact, motion);
    const double dashpot = dem2di_dashpot(law, inverse > 0 ? 1 / inverse : 0);
    rows->approach[first] = approach;
    rows->dashpot[first] = dashpot;
    for (int k = first; k < rows->count && rows->count - first == 2; k++) {
        const dem2di_point_pair *pair = &world->list.contacts.point_pairs[i - world->list.discs];
        rows->approach[k] = approach + spin * pair->offset[k - first];
        rows->dashpot[k] = pair->weight[k - first] * dashpot;
    }
    if (!(world->plan.terms & DEM2DI_ROLLING)) return;
    bool rolls = law->rolling_friction > 0;
    double radius = rolls ? dem2di_reduced_radius(world, i) : 0;
    rows->spin[first] = spin;
    rows->rolling_stiffness[first] = dem2di_rolling_stiffness(law, radius);
    rows->rolling_friction[first] = law->rolling_friction * radius;
    rows->last_moment[first] = last->from->moment[last->at];
    if (world->law != NULL) rows->state[first] = last->from->state[last->at];
}

/* One row of springs and friction. */
static DEM2DI_INLINE void dem2di_law_add_row(const dem2d_pair_desc *law, int i, double weight,
                                             double depth, double slip, double last_shear,
                                             dem2di_law_rows *rows) {
    int k = rows->count++;
    rows->contact[k] = i;
    rows->depth[k] = depth;
    rows->sliding[k] = slip;
    rows->stiffness[k] = law->normal_stiffness * weight;
    rows->tangential_stiffness[k] = law->tangential_stiffness * weight;
    rows->friction[k] = law->friction;
    rows->last_shear[k] = last_shear;
}

/* The rows of two points, both with the contact's slip: it depends on the height along the normal
   alone. */
static void dem2di_law_add_two(const dem2d_world *world, int i, const dem2di_last *last,
                               double slip, dem2di_law_rows *rows) {
    const dem2d_pair_desc *law = dem2di_law_of(world, i);
    const dem2di_point_pair *pair = &world->list.contacts.point_pairs[i - world->list.discs];
    double force[2], shear[2];
    for (int k = 0; k < 2; k++) force[k] = law->normal_stiffness * pair->weight[k] * pair->depth[k];
    dem2di_point_pair_carry(&last->contact, &last->pair, pair, force, shear);
    for (int k = 0; k < 2; k++)
        dem2di_law_add_row(law, i, pair->weight[k], pair->depth[k], slip, shear[k], rows);
}

/* A contact whose geometry is known, as rows for the law. */
static DEM2DI_INLINE void dem2di_law_add(const dem2d_world *world, int i, const dem2di_last *last,
                                         bool two, const dem2di_contact *contact,
                                         dem2di_law_rows *rows) {
    const dem2d_pair_desc *law = dem2di_law_of(world, i);
    const bool terms = world->plan.terms != 0;
    const int first = rows->count;
    dem2di_relative_motion motion;
    double slip = 0;
    if (law->friction > 0 || terms) motion = dem2di_motion_of(world, i);
    if (law->friction > 0 || world->law != NULL)
        slip = dem2di_slip(&last->contact, contact, &motion);
    if (two)
        dem2di_law_add_two(world, i, last, slip, rows);
    else
        dem2di_law_add_row(law, i, 1, contact->depth, slip, last->contact.shear, rows);
    if (terms) dem2di_law_add_terms(world, i, last, contact, &motion, first, rows);
}

/* Forces of a contact of two points into the columns. Dashpots may move its centre. */
static void dem2di_law_put_two(dem2d_world *world, int i, const dem2di_law_rows *rows, int k,
                               dem2di_contact *contact) {
    const int at = i - world->list.discs;
    dem2di_point_pair *pair = &world->list.contacts.point_pairs[at];
    const double *force = rows->force + k;
    contact->force = force[0] + force[1];
    contact->shear = rows->shear[k] + rows->shear[k + 1];
    for (int p = 0; p < 2; p++) pair->shear[p] = rows->shear[k + p];
    if (!(world->plan.terms & DEM2DI_DASHPOT)) return;
    for (int p = 0; p < 2; p++)
        world->list.contacts.point_viscous[at].at[p] =
            force[p] - rows->stiffness[k + p] * rows->depth[k + p];
    if (!(contact->force > 0)) return;
    double move =
        force[0] / contact->force * pair->offset[0] + force[1] / contact->force * pair->offset[1];
    dem2di_arms_shift(&contact->arms, move);
    for (int p = 0; p < 2; p++) pair->offset[p] -= move;
    world->list.contacts.arms[at] = contact->arms;
}

/* Forces of the contact of row k into the columns, and its loads. Returns the number of its rows.
 */
static DEM2DI_INLINE int dem2di_law_put(dem2d_world *world, const dem2di_law_rows *rows, int k,
                                        dem2di_count *count) {
    const dem2di_contacts *contacts = &world->list.contacts;
    const int i = rows->contact[k];
    const bool two = k + 1 < rows->count && rows->contact[k + 1] == i;
    double moment = 0;
    dem2di_contact contact;
    (void)dem2di_contact_get(world, contacts, i, &contact);
    contact.force = rows->force[k];
    contact.shear = rows->shear[k];
    if (two) dem2di_law_put_two(world, i, rows, k, &contact);
    if (world->plan.terms & DEM2DI_ROLLING) contacts->moment[i] = moment = rows->moment[k];
    contacts->force[i] = contact.force;
    contacts->shear[i] = contact.shear;
    dem2d_vec force = dem2di_contact_force(&contact);
    world->load_x[i] = force.x;
    world->load_y[i] = force.y;
    world->load_a[i] = dem2di_torque_a(&contact, moment);
    world->load_b[i] = dem2di_torque_b(&contact, moment);
    double sum = fabs(force.x) + fabs(force.y) + fabs(world->load_a[i]) + fabs(world->load_b[i]);
    count->unsound += !dem2di_finite(sum);
    if (!world->bounded) count->load = dem2di_max(count->load, sum);
    return two ? 2 : 1;
}

/* What the caller's law says of contact i, in row k, at a depth and an approach speed. */
static void dem2di_ask_law(const dem2d_world *world, const dem2di_law_rows *rows, int k,
                           double depth, double approach, dem2d_law_output *output) {
    const dem2di_list *list = &world->list;
    const int i = rows->contact[k];
    const dem2di_key *key = &list->keys[i];
    const double inverse = dem2di_reduced_inverse(world, i);
    dem2d_law_input input;
    memset(&input, 0, sizeof input);
    memset(output, 0, sizeof *output);
    input.pair = *dem2di_law_of(world, i);
    input.a = dem2di_particle_id(world, key->a);
    if (i < list->pairs)
        input.b = dem2di_particle_id(world, key->b);
    else
        input.wall = dem2di_wall_id(world, dem2di_wall_of(world, i));
    input.normal = dem2di_vec(list->contacts.normal_x[i], list->contacts.normal_y[i]);
    input.time_step = world->made_step;
    input.depth = depth;
    input.approach = approach;
    input.sliding = rows->sliding[k];
    input.spin = rows->spin[k];
    input.mass = inverse > 0 ? 1 / inverse : 0;
    input.radius = dem2di_reduced_radius(world, i);
    input.tangential_force = rows->last_shear[k];
    input.moment = rows->last_moment[k];
    memcpy(input.state, &rows->state[k], sizeof input.state);
    memcpy(output->state, input.state, sizeof output->state);
    world->law(world->law_user, &input, output);
}

/* The caller's law for all rows. */
static void dem2di_law_ask(dem2d_world *world, dem2di_law_rows *rows) {
    const dem2di_contacts *contacts = &world->list.contacts;
    for (int k = 0; k < rows->count; k++) {
        dem2d_law_output output;
        dem2di_ask_law(world, rows, k, rows->depth[k], rows->approach[k], &output);
        rows->force[k] = output.normal_force;
        rows->shear[k] = output.tangential_force;
        rows->moment[k] = output.moment;
        contacts->energy[rows->contact[k]] = output.energy;
        memcpy(&contacts->state[rows->contact[k]], output.state, sizeof output.state);
    }
}

/* The law for the rows: their forces into the columns. */
static void dem2di_law_apply(dem2d_world *world, dem2di_law_rows *rows, dem2di_count *count) {
    if (world->law != NULL)
        dem2di_law_ask(world, rows);
    else
        dem2di_law_solve(rows, world->made_step, world->plan.terms);
    for (int k = 0; k < rows->count;) k += dem2di_law_put(world, rows, k, count);
    rows->count = 0;
}

/* Makes room in the rows for one more contact. */
static inline void dem2di_law_room(dem2d_world *world, dem2di_law_rows *rows, dem2di_count *count) {
    if (rows->count > DEM2DI_BATCH - 2) dem2di_law_apply(world, rows, count);
}

/* Where contact i has its points, beside it when there are two; B's centre is at d. A circle has
   its point on the line of the normal: at the middle of an overlap, and on a wall at the foot. Both
   arms are of one point, so that the two torques and the forces' moment add up to nothing. */
static DEM2DI_INLINE void dem2di_contact_place(dem2d_world *world, int i, int count,
                                               const dem2d_contact_point points[2], dem2d_vec d,
                                               dem2di_contact *contact) {
    const dem2di_list *list = &world->list;
    const dem2di_key *key = &list->keys[i];
    const bool wall = i >= list->pairs, turns = world->plan.turns; /* circles have a lever of 0 */
    const bool circle_a = !turns || world->lever[key->a] == 0;
    const bool circle_b = !wall && (!turns || world->lever[key->b] == 0);
    const double depth = contact->depth;
    dem2di_arms *arms = &contact->arms;
    dem2d_vec point = points[0].position;
    if (count == 2)
        point =
            dem2di_point_pair_set(points, &list->contacts.point_pairs[i - list->discs], contact);
    const double along = dem2di_dot(contact->normal, d), across = dem2di_cross(contact->normal, d);
    arms->a_n = dem2di_dot(contact->normal, point);
    arms->a_t = dem2di_cross(contact->normal, point);
    if (circle_a) {
        arms->a_n = world->now[key->a].radius - (wall ? depth : depth / 2);
        arms->a_t = 0;
    } else if (circle_b) {
        arms->a_n = along - (world->now[key->b].radius - depth / 2);
        arms->a_t = across;
    }
    arms->b_n = wall ? 0 : arms->a_n - along;
    arms->b_t = wall ? 0 : arms->a_t - across;
    if (circle_a && circle_b && world->solver != DEM2D_GJK_EPA) { /* as in the kernel of circles */
        arms->b_n = -(world->now[key->b].radius - depth / 2);
        arms->b_t = 0;
    }
}

static inline void dem2di_no_load(dem2d_world *world, int i) {
    world->load_x[i] = world->load_y[i] = world->load_a[i] = world->load_b[i] = 0;
}

/* Contact i is apart: nothing acts. The normal is that of the search. */
static void dem2di_contact_apart(dem2d_world *world, int i, dem2d_vec normal) {
    dem2di_contact contact;
    memset(&contact, 0, sizeof contact);
    contact.normal = normal;
    contact.depth = -1;
    dem2di_geometry_put(&world->list, i, &contact);
    dem2di_contact_clear(world, i);
    dem2di_no_load(world, i);
}

/* A contact whose points are to be found has none yet. */
static inline void dem2di_points_clear(const dem2d_world *world, int i) {
    dem2di_point_pair *pairs = world->list.contacts.point_pairs;
    if (world->plan.faces) memset(&pairs[i - world->list.discs], 0, sizeof *pairs);
}

/* Geometry of one listed pair that is not of two circles, and its rows for the law. */
static void dem2di_update_pair(dem2d_world *world, int i, dem2di_law_rows *rows,
                               dem2di_count *count) {
    dem2di_list *list = &world->list;
    int a = list->keys[i].a, b = list->keys[i].b;
    dem2di_history *history = &list->contacts.history[i - list->discs];
    dem2di_last last;
    dem2di_contact contact;
    dem2d_contact_point points[2];
    dem2di_last_get(world, &list->contacts, i, &last);
    contact.normal = last.contact.normal;
    dem2di_points_clear(world, i);
    int found = dem2di_collide_pair(world, a, b, &last.contact, history, &contact, points, count);
    if (found == 0) {
        dem2di_contact_apart(world, i, contact.normal);
        return;
    }
    dem2d_vec d = dem2di_centre_line(world->now[a].x, world->now[b].x);
    dem2di_contact_place(world, i, found, points, d, &contact);
    dem2di_law_add(world, i, &last, found == 2, &contact, rows);
    dem2di_geometry_put(list, i, &contact);
}

/* A particle at a half-plane: one support call, none for a circle. Returns the number of points. */
static int dem2di_collide_plane(const dem2d_world *world, int a, int part, dem2di_contact *contact,
                                dem2d_contact_point points[2], dem2di_count *count) {
    const dem2di_body *body = &world->bodies[a];
    const dem2d_shape *shape = dem2di_shape_of(world, body);
    const dem2di_state *state = &world->now[a];
    dem2d_vec point = world->surfaces[part].point;
    dem2d_vec u = dem2di_negate(dem2di_surface_normal(&world->surfaces[part]));
    dem2d_vec support = dem2di_scale(u, state->radius);
    contact->normal.x = u.x;
    contact->normal.y = u.y;
    double surface = dem2di_dot(dem2di_sub(point, state->x), u);
    contact->depth = state->radius - surface;
    if (!(contact->depth > 0)) return 0;
    if (shape->type != DEM2D_CIRCLE) {
        dem2d_pose pose = dem2di_pose_of(world, world->now, a);
        dem2d_vec own = dem2di_support(shape, dem2di_turn_back(pose.rotation, u), NULL);
        support = dem2di_at_pose(&pose, own);
        contact->depth = dem2di_wall_depth(&pose, point, u, support);
        count->calls++;
        if (!(contact->depth > 0)) return 0;
    }
    if (world->plan.faces && shape->flat)
        return dem2di_wall_points(shape, state->q, body->scale, u, surface, support, contact->depth,
                                  points);
    points[0].position.x = support.x - contact->depth * u.x;
    points[0].position.y = support.y - contact->depth * u.y;
    return 1;
}

/* A particle at a segment: a pair, of which only what is near the particle counts, so that the
   search is as exact as for its neighbours. Points are on the segment. */
static int dem2di_collide_segment(const dem2d_world *world, int a, int part,
                                  const dem2di_contact *last, dem2di_history *history,
                                  dem2di_contact *contact, dem2d_contact_point points[2],
                                  dem2di_count *count) {
    const dem2di_surface *surface = &world->surfaces[part];
    const dem2di_body *body = &world->bodies[a];
    const dem2di_state *state = &world->now[a];
    const dem2d_rot none = {1, 0};
    if (!(dem2di_part_distance(world, part, state->x) < state->radius)) return 0;
    dem2d_vec along = dem2di_vec(surface->along.c, surface->along.s);
    dem2d_vec start = dem2di_sub(surface->point, state->x);
    double foot = -dem2di_dot(start, along), reach = 2 * state->radius, gap;
    double from = dem2di_max(0, foot - reach),
           to = dem2di_min(world->parts[part].extent, foot + reach);
    dem2di_pair pair;
    pair.a = dem2di_shape_of(world, body);
    pair.b = world->line;
    pair.ra = pair.a->type == DEM2D_CIRCLE ? none : state->q;
    pair.rb = surface->along;
    pair.scale_a = body->scale;
    pair.scale_b = to - from;
    pair.d = dem2di_along(start, from + (to - from) / 2, along);
    pair.distance = dem2di_length(pair.d);
    pair.size = state->radius + pair.scale_b / 2 + pair.distance;
    int found = dem2di_collide_shapes(world, &pair, last, history, contact, points, &gap, count);
    for (int k = 0; k < found; k++) {
        double depth = found == 2 ? points[k].depth : contact->depth;
        points[k].position = dem2di_along(points[k].position, -depth / 2, contact->normal);
        points[k].normal = contact->normal; /* joints go by it */
    }
    return found;
}

/* The rows of a contact with a wall whose geometry is known. */
static void dem2di_wall_add(dem2d_world *world, int i, const dem2di_last *last,
                            dem2di_contact *contact, dem2di_law_rows *rows) {
    bool two = dem2di_point_pair_of(world, &world->list.contacts, i) != NULL;
    if (world->faces == DEM2D_ONE_POINT) /* [P] fig. 4b: from the foot point to the middle */
        contact->arms.a_n += contact->depth / 2;
    dem2di_law_add(world, i, last, two, contact, rows);
    dem2di_geometry_put(&world->list, i, contact);
}

/* The same as for a pair, for a particle and a wall. Where segments are joined, the law comes after
   all of the geometry. */
static void dem2di_update_wall_contact(dem2d_world *world, int i, dem2di_law_rows *rows,
                                       dem2di_count *count) {
    dem2di_list *list = &world->list;
    int a = list->keys[i].a, j = list->keys[i].b;
    bool segment = world->parts[j].extent > 0;
    dem2di_history *history = &list->contacts.history[i - list->discs];
    dem2di_last last;
    dem2di_contact contact;
    dem2d_contact_point points[2];
    dem2di_last_get(world, &list->contacts, i, &last);
    contact.normal = last.contact.normal;
    dem2di_points_clear(world, i);
    int found = segment ? dem2di_collide_segment(world, a, j, &last.contact, history, &contact,
                                                 points, count)
                        : dem2di_collide_plane(world, a, j, &contact, points, count);
    if (found == 0) {
        dem2di_contact_apart(world, i, contact.normal);
        return;
    }
    dem2di_contact_place(world, i, found, points, dem2di_vec(0, 0), &contact);
    if (segment && world->plan.joints)
        dem2di_geometry_put(list, i, &contact);
    else
        dem2di_wall_add(world, i, &last, &contact, rows);
}

/* --- joints of segments: of two contacts at the same place one is left -------------------------
 */

/* A corner (sine) this small is rounding: the contact is along the segment's side. */
#define DEM2DI_CORNER 1e-8

/* Which end of its segment a contact is at, or -1: along the side. */
static int dem2di_segment_corner(const dem2d_world *world, int contact) {
    dem2d_rot along = world->surfaces[world->list.keys[contact].b].along;
    const dem2di_contacts *contacts = &world->list.contacts;
    double sine = contacts->normal_x[contact] * along.c + contacts->normal_y[contact] * along.s;
    return fabs(sine) <= DEM2DI_CORNER ? -1 : sine < 0;
}

/* Which point of a contact is at a place, or -1. */
static int dem2di_point_near(const dem2d_world *world, int i, dem2d_vec place) {
    const dem2di_list *list = &world->list;
    const dem2di_point_pair *pair = dem2di_point_pair_of(world, &list->contacts, i);
    const dem2di_state *a = &world->now[list->keys[i].a];
    dem2di_contact contact;
    (void)dem2di_contact_get(world, &list->contacts, i, &contact);
    dem2d_vec from = dem2di_sub(place, dem2di_add(a->x, dem2di_arm_a(&contact)));
    for (int k = 0; k < (pair != NULL ? 2 : 1); k++) {
        double offset = pair != NULL ? pair->offset[k] : 0;
        dem2d_vec left = dem2di_along(from, -offset, dem2di_perp(contact.normal));
        if (dem2di_length(left) <= DEM2DI_JOINT * a->radius) return k;
    }
    return -1;
}

static bool dem2di_meets_segment(const dem2d_world *world, const dem2di_contacts *from, int i) {
    const dem2di_list *list = &world->list;
    return i >= list->pairs && world->parts[list->keys[i].b].extent > 0 && from->depth[i] > 0;
}

/* A contact of two points keeps the other one. */
static void dem2di_drop_point(dem2d_world *world, int i, int point) {
    const dem2di_list *list = &world->list;
    const dem2di_contacts *contacts = &list->contacts;
    dem2di_point_pair *pair = &contacts->point_pairs[i - list->discs];
    contacts->depth[i] = pair->depth[1 - point];
    dem2di_arms_shift(&contacts->arms[i - list->discs], pair->offset[1 - point]);
    memset(pair, 0, sizeof *pair);
}

/* Two contacts of a particle with segments a < b: the one at the end of its segment yields to one
   along the side of the other, of two at the ends the second, of two points where faces meet on
   both sides of the joint both. Segments in line are one face, which has no point at the joint. */
static void dem2di_joint_yield(dem2d_world *world, int a, int b) {
    const dem2di_list *list = &world->list;
    const int contact[2] = {a, b}, part[2] = {list->keys[a].b, list->keys[b].b};
    int which[2], near[2];
    bool two[2], ends[2], side[2];
    dem2d_vec at;
    if (!dem2di_segments_meet(world, part[0], part[1], which, &at)) return;
    for (int k = 0; k < 2; k++) {
        int corner = dem2di_segment_corner(world, contact[k]);
        near[k] = dem2di_point_near(world, contact[k], at);
        two[k] = dem2di_point_pair_of(world, &list->contacts, contact[k]) != NULL;
        ends[k] = corner == which[k];
        side[k] = corner < 0;
    }
    dem2d_rot one = world->surfaces[part[0]].along, other = world->surfaces[part[1]].along;
    bool flat = fabs(one.c * other.s - one.s * other.c) <= DEM2DI_CORNER;
    bool both = side[0] && side[1] && near[0] >= 0 && near[1] >= 0;
    if (ends[0] || ends[1])
        list->contacts.depth[contact[ends[1] ? 1 : 0]] = 0;
    else if (both && !two[0] && !two[1])
        list->contacts.depth[b] = 0;
    for (int k = 0; k < 2; k++)
        if (side[k] && two[k] && near[k] >= 0 && (flat || (k == 1 && both)))
            dem2di_drop_point(world, contact[k], near[k]);
}

/* Where the springs of a contact are: of a new one, those of a contact that it took over from. */
static int dem2di_joint_source(const dem2d_world *world, int contact) {
    const dem2di_list *list = &world->list;
    const dem2di_key *key = &list->keys[contact];
    int which[2];
    dem2d_vec at;
    if (list->last.depth[contact] > 0) return contact;
    for (int k = list->own[key->a]; k < list->first[key->a + 1]; k++) {
        int other = list->adjacent[k];
        if (dem2di_meets_segment(world, &list->last, other) &&
            !dem2di_meets_segment(world, &list->contacts, other) &&
            dem2di_segments_meet(world, key->b, list->keys[other].b, which, &at))
            return other;
    }
    return contact;
}

/* The resolve pass: of the contacts of a particle with joined segments, which count. One after the
   other, as few of any scene's are at segments. */
static void dem2di_resolve_joints(dem2d_world *world) {
    const dem2di_list *list = &world->list;
    for (int i = list->pairs; i < list->count; i++) {
        int a = list->keys[i].a;
        if (!dem2di_meets_segment(world, &list->contacts, i)) continue;
        for (int k = list->own[a]; k < list->first[a + 1]; k++) {
            int other = list->adjacent[k];
            if (other > i && dem2di_meets_segment(world, &list->contacts, i) &&
                dem2di_meets_segment(world, &list->contacts, other))
                dem2di_joint_yield(world, i, other);
        }
    }
}

/* The law for all contacts with segments, whose springs may be those of another contact. */
static void dem2di_force_joints(dem2d_world *world, dem2di_count *count) {
    dem2di_list *list = &world->list;
    dem2di_law_rows rows;
    rows.count = 0;
    for (int i = list->pairs; i < list->count; i++) {
        dem2di_contact contact;
        dem2di_last last;
        if (!(world->parts[list->keys[i].b].extent > 0)) continue;
        if (!dem2di_contact_get(world, &list->contacts, i, &contact)) {
            dem2di_contact_clear(world, i);
            dem2di_no_load(world, i);
            continue;
        }
        dem2di_law_room(world, &rows, count);
        dem2di_last_get(world, &list->last, dem2di_joint_source(world, i), &last);
        dem2di_wall_add(world, i, &last, &contact, &rows);
    }
    dem2di_law_apply(world, &rows, count);
}

/* May the two of a listed pair that is not of two circles have met since they were found apart? */
static inline bool dem2di_may_meet(const dem2d_world *world, int i) {
    const dem2di_key *key = &world->list.keys[i];
    double bound = world->list.contacts.history[i - world->list.discs].bound;
    return !(world->displacement[key->a] + world->displacement[key->b] < bound);
}

/* A listed pair that is not of two circles; the rows have room. */
static inline void dem2di_collide(dem2d_world *world, int i, dem2di_law_rows *rows,
                                  dem2di_count *count) {
    if (world->immovable && dem2di_immovable(world, i)) {
        dem2di_contact_end(world, i);
        dem2di_no_load(world, i);
    } else if (i >= world->list.pairs) {
        dem2di_update_wall_contact(world, i, rows, count);
    } else if (dem2di_may_meet(world, i)) {
        dem2di_update_pair(world, i, rows, count);
    }
}

/* The contacts of a block that are not of two circles: first their geometry, then the law, whenever
   the rows are full. */
static void dem2di_others_range(dem2d_world *world, int begin, int end, dem2di_count *count) {
    dem2di_law_rows rows;
    rows.count = 0;
    for (int i = begin; i < end; i++) {
        dem2di_law_room(world, &rows, count);
        dem2di_collide(world, i, &rows, count);
    }
    dem2di_law_apply(world, &rows, count);
}

/* Blocks of the three kinds of contacts, one kind after the other. */
static void dem2di_force_task(void *context, int begin, int end) {
    dem2d_world *world = (dem2d_world *)context;
    const dem2di_list *list = &world->list;
    int discs = dem2di_blocks(list->discs, DEM2DI_BLOCK);
    for (int block = begin; block < end; block++) {
        dem2di_count *count = &world->block_results[block].count;
        bool round = block < discs;
        int size = round ? DEM2DI_BLOCK : DEM2DI_BLOCK_OTHERS;
        int first = round ? block * size : list->discs + (block - discs) * size;
        int last = dem2di_block_end(first, size, round ? list->discs : list->count);
        memset(count, 0, sizeof *count);
        if (world->keeps_last) dem2di_contacts_keep(world, first, last, false);
        if (round)
            dem2di_disc_range(world, first, last, count);
        else
            dem2di_others_range(world, first, last, count);
    }
}

static void dem2di_count_add(dem2di_count *sum, const dem2di_count *part) {
    sum->calls += part->calls;
    sum->collisions += part->collisions;
    sum->separations += part->separations;
    sum->unsound += part->unsound;
    sum->load = dem2di_max(sum->load, part->load);
    for (int k = 0; k < DEM2D_PROOF_COUNT; k++) sum->proofs[k] += part->proofs[k];
}

/* Geometry and forces of all contacts, over those of the last pass. */
static void dem2di_force_pass(dem2d_world *world, dem2di_count *count) {
    const dem2di_list *list = &world->list;
    count->load = 0;
    int blocks = dem2di_force_blocks(list->discs, list->count);
    dem2di_run(world, DEM2D_PHASE_CONTACTS, blocks, dem2di_force_task, world);
    for (int k = 0; k < blocks; k++) dem2di_count_add(count, &world->block_results[k].count);
    if (!world->plan.joints) return;
    dem2di_resolve_joints(world);
    dem2di_force_joints(world, count);
}

/* Part of the normal stiffness that the two points carry together. */
static double dem2di_point_pair_weight(const dem2di_point_pair *pair) {
    return pair->weight[0] + pair->weight[1];
}

/* Forces on the walls, in the order of the particles' ranks. */
static void dem2di_wall_sums(dem2d_world *world) {
    const dem2di_list *list = &world->list;
    for (int j = 0; j < world->wall_count; j++) {
        world->wall_next[j] = world->wall_now[j];
        world->wall_next[j].force = dem2di_vec(0, 0);
    }
    for (int i = list->pairs; i < list->count; i++) {
        dem2di_contact contact;
        if (!dem2di_contact_get(world, &list->contacts, i, &contact)) continue;
        dem2di_wall_state *wall = &world->wall_next[dem2di_wall_of(world, i)];
        wall->force = dem2di_add(wall->force, dem2di_contact_force(&contact));
    }
}

/* Sum of the contact forces on a particle, one after the other in the order of the partners' ranks:
   contacts that are apart add nothing, so that it does not matter which of them are listed. */
static DEM2DI_INLINE dem2di_load dem2di_gather(const dem2d_world *world, int slot, bool spin) {
    const dem2di_list *list = &world->list;
    const int *entry = list->adjacent + list->first[slot], *own = list->adjacent + list->own[slot];
    const int *end = list->adjacent + list->first[slot + 1];
    const double *x = world->load_x, *y = world->load_y;
    dem2di_load sum = {{0, 0}, 0};
    for (; entry < own; entry++) { /* of which it is B */
        sum.force.x += x[*entry];
        sum.force.y += y[*entry];
        if (spin) sum.torque += world->load_b[*entry];
    }
    for (; entry < end; entry++) {
        sum.force.x -= x[*entry];
        sum.force.y -= y[*entry];
        if (spin) sum.torque += world->load_a[*entry];
    }
    return sum;
}

/* Room for the sums that the caller may change. */
static bool dem2di_sums_reserve(dem2d_world *world) {
    return world->gather == NULL ||
           (dem2di_group_reserve(world, DEM2DI_SUMS, world->body_count) &&
            dem2di_group_reserve(world, DEM2DI_EXCHANGED, world->id_count) &&
            dem2di_group_reserve(world, DEM2DI_WALLS_EXCHANGED, world->wall_count));
}

static void dem2di_gather_task(void *context, int begin, int end) {
    dem2d_world *world = (dem2d_world *)context;
    int last = dem2di_block_end((end - 1) * DEM2DI_BLOCK, DEM2DI_BLOCK, world->body_count);
    for (int i = begin * DEM2DI_BLOCK; i < last; i++)
        world->sums[i] = dem2di_gather(world, i, true);
}

/* The caller's look at the sums, in the order of ids. */
static void dem2di_exchange(dem2d_world *world) {
    dem2d_sums *sums = &world->exchange;
    sums->particles = world->id_count;
    sums->walls = world->wall_count;
    for (int back = 0; back < 2; back++) {
        for (int index = 0; index < world->id_count; index++) {
            const dem2di_load none = {{0, 0}, 0};
            int slot = world->ids[index].slot;
            if (back && slot >= 0) {
                world->sums[slot].force = sums->force[index];
                world->sums[slot].torque = sums->torque[index];
            } else if (!back) {
                sums->force[index] = slot >= 0 ? world->sums[slot].force : none.force;
                sums->torque[index] = slot >= 0 ? world->sums[slot].torque : none.torque;
            }
        }
        for (int j = 0; j < world->wall_count; j++)
            if (back)
                world->wall_next[j].force = sums->wall_force[j];
            else
                sums->wall_force[j] = world->wall_next[j].force;
        if (!back) world->gather(world->exchange_user, sums);
    }
}

/* The gather pass, where the caller may change the sums. */
static void dem2di_gather_pass(dem2d_world *world) {
    if (world->gather == NULL) return;
    dem2di_run(world, DEM2D_PHASE_MOTION, dem2di_blocks(world->body_count, DEM2DI_BLOCK),
               dem2di_gather_task, world);
    dem2di_exchange(world);
}

/* The sum of the contact forces on a particle, as the caller has left it. */
static DEM2DI_INLINE dem2di_load dem2di_sum_of(const dem2d_world *world, int slot, bool spin) {
    return world->gather != NULL ? world->sums[slot] : dem2di_gather(world, slot, spin);
}

/* A particle a step later. Pushed: there are external loads, or sums that the caller has left. */
static DEM2DI_INLINE dem2di_state dem2di_integrate(const dem2d_world *world, int slot,
                                                   const dem2di_damping *damping, bool heavy,
                                                   bool damped, bool spin, bool turns,
                                                   bool pushed) {
    const double time_step = world->time_step;
    const dem2di_inverse *inverse = &world->inverse[slot];
    dem2di_state next = world->now[slot];
    if (inverse->mass > 0) {
        dem2di_load load =
            pushed ? dem2di_sum_of(world, slot, spin) : dem2di_gather(world, slot, spin);
        if (pushed && world->loaded) {
            load.force = dem2di_add(load.force, world->loads[slot].force);
            load.torque += world->loads[slot].torque;
        }
        dem2d_vec a = dem2di_scale(load.force, inverse->mass);
        double turn = load.torque * inverse->inertia;
        if (heavy) a = dem2di_add(world->gravity, a);
        if (damped) {
            next.v.x = dem2di_accelerate(damping, next.v.x, a.x);
            next.v.y = dem2di_accelerate(damping, next.v.y, a.y);
            if (spin) next.w = dem2di_accelerate(damping, next.w, turn);
        } else {
            next.v = dem2di_along(next.v, time_step, a);
            if (spin) next.w += time_step * turn;
        }
    }
    next.x = dem2di_along(next.x, time_step, next.v);
    if (spin && turns) next.q = dem2di_rotate(next.q, next.w * time_step);
    if (spin && !turns) next.q.c = dem2di_turned(next.q.c, next.w * time_step);
    return next;
}

/* The same, for the few particles of which it must be known before the others move. */
static dem2di_state dem2di_foresee(const dem2d_world *world, int slot) {
    dem2di_damping damping =
        dem2di_damping_make(world->local_damping, world->global_damping, world->time_step);
    return dem2di_integrate(world, slot, &damping, true, true, true, world->plan.turns, true);
}

/* --- servo walls --------------------------------------------------------------------------------
   A wall's new speed V along its normal moves it to where the next force pass finds it, and is the
   speed that the dashpots meet there. A contact whose spring presses with f now presses then with
       max(0, f + (k dt + c) (V - u)),
   with its stiffness k, its dashpot c and the speed u at which the particle's surface leaves the
   wall. The particle's step depends on the forces of this pass alone, so that u is known. The wall
   takes the V at which these forces, which never fall with V, add up to
       target - b (V - drift).
   So the force is right in every step, whatever the dashpots, and no feedback can become unstable.
   The resistance b takes energy from the vibration of the contacts; as the drift follows V, it
   does not bias the mean force when the particles yield steadily. */

/* b over sqrt(k m), of the contacts and the particles at the wall: a tenth of the critical damping
   of one of them, which takes half of the energy of a wave that meets the wall: 1 - (0.8/1.2)^2. */
#define DEM2DI_SERVO_LOSS 0.2

/* b over k dt is at least this. Where nothing yields behind the wall, each step then makes up for
   1/1.25 of the missing force: stable up to 2.5 times the stiffness that is known. */
#define DEM2DI_SERVO_MARGIN 0.25

/* How much of its past the drift forgets in a time of sqrt(m/k): it remembers ten of them, about
   three contact times, which is long against a vibration and short against any loading. */
#define DEM2DI_SERVO_MEMORY 0.1

static double dem2di_servo_resistance(const dem2di_backing *backing, double time_step) {
    double least = DEM2DI_SERVO_MARGIN * backing->stiffness * time_step;
    double loss = DEM2DI_SERVO_LOSS * sqrt(backing->stiffness * backing->mass);
    return dem2di_max(least, loss);
}

/* Part of what it remembers that a servo wall forgets in a step. */
static double dem2di_servo_forgets(const dem2di_backing *backing, double time_step) {
    if (!(backing->mass > 0)) return DEM2DI_SERVO_MEMORY;
    double times = time_step * sqrt(backing->stiffness / backing->mass);
    return DEM2DI_SERVO_MEMORY * dem2di_min(1, times);
}

/* A caller's law is asked how its force rises with the speed: for a contact that closes a little
   faster and is as much deeper. `elastic` is k dt. */
static void dem2di_push_ask(const dem2d_world *world, int i, const dem2di_contact *contact,
                            double elastic, double *impedance, double *spring) {
    dem2di_last last;
    dem2di_law_rows rows;
    rows.count = 0;
    dem2di_last_get(world, &world->list.last, i, &last);
    dem2di_law_add(world, i, &last, false, contact, &rows);
    double closing = rows.approach[0], deeper = contact->depth / 16;
    double faster = deeper / world->time_step;
    dem2d_law_output output;
    dem2di_ask_law(world, &rows, 0, contact->depth + deeper, closing + faster, &output);
    *impedance = dem2di_max((output.normal_force - contact->force) / faster, *impedance);
    *spring = contact->force - (*impedance - elastic) * closing;
}

/* A contact of a servo wall in the next pass; what it adds to the wall's backing. */
static dem2di_push dem2di_push_make(const dem2d_world *world, int i, const dem2di_contact *contact,
                                    dem2d_vec normal, dem2di_backing *backing) {
    const dem2di_list *list = &world->list;
    const dem2d_pair_desc *law = dem2di_law_of(world, i);
    const dem2di_point_pair *pair = dem2di_point_pair_of(world, &list->contacts, i);
    int a = list->keys[i].a;
    double inverse = world->inverse[a].mass, mass = inverse > 0 ? 1 / inverse : 0;
    double weight = 1, spring = contact->force;
    dem2di_arms arms = contact->arms;
    if (pair != NULL) { /* their springs act at the centre of the weights */
        weight = dem2di_point_pair_weight(pair);
        double offset = pair->weight[0] * pair->offset[0] + pair->weight[1] * pair->offset[1];
        dem2di_arms_shift(&arms, offset / weight);
    }
    double stiffness = weight * law->normal_stiffness;
    double elastic = stiffness * world->time_step;
    double impedance = elastic + weight * dem2di_dashpot(law, mass);
    if (world->plan.terms & DEM2DI_DASHPOT)
        spring -= dem2di_viscous_of(world, &list->contacts, i, 0) +
                  dem2di_viscous_of(world, &list->contacts, i, 1);
    if (world->law != NULL) dem2di_push_ask(world, i, contact, elastic, &impedance, &spring);
    dem2di_state next = dem2di_foresee(world, a);
    double leaves = dem2di_dot(contact->normal, next.v) - arms.a_t * next.w;
    dem2di_push push;
    push.along = -dem2di_dot(contact->normal, normal);
    push.force = spring + impedance * leaves;
    push.rise = impedance * push.along;
    backing->stiffness += stiffness;
    backing->impedance += impedance;
    backing->mass += mass;
    return push;
}

/* Sum of the forces on a servo wall at a speed, and how it rises with the speed. A caller's law may
   pull. */
static double dem2di_pushes_sum(const dem2di_push *pushes, int count, bool pulls, double speed,
                                double *rise) {
    double sum = 0;
    *rise = 0;
    for (int i = 0; i < count; i++) {
        double force = pushes[i].force + pushes[i].rise * speed;
        if (!(force > 0) && !pulls) continue;
        sum += pushes[i].along * force;
        *rise += pushes[i].along * pushes[i].rise;
    }
    return sum;
}

/* The speed in [-top, top] at which the pushes and the resistance times the speed add up to `aim`,
   or come nearest to it, from a guess. Newton's iteration on lines that bend up ends after as many
   bends; where a segment is pushed from both sides it may leave the bracket, which is then halved.
 */
static double dem2di_servo_balance(const dem2di_push *pushes, int count, bool pulls,
                                   double resistance, double aim, double guess, double top) {
    double low = -top, high = top, speed = guess, before = -1, rise;
    if (dem2di_pushes_sum(pushes, count, pulls, high, &rise) + resistance * high <= aim) return top;
    if (dem2di_pushes_sum(pushes, count, pulls, low, &rise) + resistance * low >= aim) return -top;
    for (int i = 0; i < 64; i++) { /* halving alone would have come to the rounding of top */
        double over = dem2di_pushes_sum(pushes, count, pulls, speed, &rise);
        over += resistance * speed - aim;
        rise += resistance;
        if (over == 0 || rise == before) break; /* on the line it was found on */
        before = rise;
        if (over > 0)
            high = speed;
        else
            low = speed;
        double next = speed - over / rise;
        speed = next > low && next < high ? next : low + (high - low) / 2;
    }
    return speed;
}

/* Without a contact a wall goes at its top speed. Where it has lost contact, so fast only that
   what it pushed against would meet it with the target and no more: a wall that is thrown off would
   else come back faster each time. It forgets this as it forgets its drift. */
static double dem2di_servo_alone(dem2di_wall_state *wall, double target, double top,
                                 double time_step) {
    dem2di_backing *backing = &wall->backing;
    double keep = 1 - dem2di_servo_forgets(backing, time_step);
    double meets = backing->impedance + dem2di_servo_resistance(backing, time_step);
    wall->drift = 0;
    backing->stiffness *= keep;
    backing->impedance *= keep;
    backing->mass *= keep;
    if (!(meets > 0)) return target > 0 ? top : target < 0 ? -top : 0;
    return dem2di_max(-top, dem2di_min(top, target / meets));
}

/* Half of what a wall's drift is above that of the servo walls that face it. All that lies between
   servo walls may slide along at a steady speed, which no force resists: this part of the drift is
   not followed in full, so that b brings it to rest. When the particles between them yield, the
   drifts of walls that face each other are equal. */
static double dem2di_servo_slides(const dem2d_world *world, int j) {
    dem2d_vec normal = world->walls[j].desc.normal;
    double sum = 0, weights = 0;
    for (int place = 0; place < world->wall_count; place++) {
        int i = world->walls[place].placed;
        const dem2di_wall *other = &world->walls[i];
        double faces = -dem2di_dot(normal, other->desc.normal);
        if (!other->alive || other->desc.mode != DEM2D_WALL_SERVO || !(faces > 0)) continue;
        sum += faces * (world->wall_now[j].drift - world->wall_now[i].drift);
        weights += faces;
    }
    return weights > 0 ? sum / weights / 2 : 0;
}

/* The new speed of servo wall j along its normal; its listed contacts are from begin to end. */
static double dem2di_servo_speed(dem2d_world *world, int j, int begin, int end) {
    const dem2d_wall_desc *desc = &world->walls[j].desc;
    const dem2di_list *list = &world->list;
    dem2di_wall_state *wall = &world->wall_next[j];
    double dt = world->time_step, top = desc->max_speed;
    double target = desc->stress * dem2di_wall_length(world, world->wall_now, j);
    dem2di_backing backing = {0, 0, 0};
    int count = 0;
    for (int i = begin; i < end; i++) {
        dem2di_contact contact;
        if (!dem2di_contact_get(world, &list->contacts, i, &contact)) continue;
        world->pushes[count++] = dem2di_push_make(world, i, &contact, desc->normal, &backing);
    }
    if (count == 0) return dem2di_servo_alone(wall, target, top, dt);
    double resistance = dem2di_servo_resistance(&backing, dt);
    double guess = dem2di_dot(wall->velocity, desc->normal);
    guess = dem2di_max(-top, dem2di_min(top, guess)); /* top may have been set lower */
    double speed = dem2di_servo_balance(world->pushes, count, world->law != NULL, resistance,
                                        target + resistance * wall->drift, guess, top);
    wall->drift +=
        dem2di_servo_forgets(&backing, dt) * (speed - wall->drift - dem2di_servo_slides(world, j));
    wall->backing = backing;
    return speed;
}

/* New wall velocities and points; true when one has left the reach of the list. Contacts with walls
   are listed in the order of the parts, and so of the walls. */
static bool dem2di_control_pass(dem2d_world *world) {
    const dem2di_list *list = &world->list;
    bool stale = false;
    int begin = list->pairs, end;
    for (int place = 0; place < world->wall_count; place++) {
        int j = world->walls[place].placed;
        const dem2di_wall *wall = &world->walls[j];
        dem2di_wall_state *next = &world->wall_next[j];
        if (!wall->alive) continue;
        if (wall->desc.mode == DEM2D_WALL_SERVO) {
            while (begin < list->count && list->keys[begin].b < wall->first) begin++;
            for (end = begin; end < list->count && dem2di_wall_of(world, end) == j;) end++;
            double speed = dem2di_servo_speed(world, j, begin, end);
            next->velocity = dem2di_scale(wall->desc.normal, speed);
        } else {
            next->velocity = dem2di_wall_velocity(world, j);
        }
        next->point = dem2di_along(next->point, world->time_step, next->velocity);
        stale = stale || !(dem2di_wall_change(world, world->wall_next, j) <= wall->skin);
    }
    return stale;
}

/* New velocities and positions of the particles from begin to end, over the states of the last
   force pass. Returns the greatest square of speed over skin. */
static DEM2DI_INLINE double dem2di_integrate_range(dem2d_world *world, int begin, int end,
                                                   bool heavy, bool damped, bool spin, bool turns,
                                                   bool pushed) {
    dem2di_damping damping =
        dem2di_damping_make(world->local_damping, world->global_damping, world->time_step);
    double most = 0;
    for (int i = begin; i < end; i++) {
        dem2di_state next =
            dem2di_integrate(world, i, &damping, heavy, damped, spin, turns, pushed);
        if (turns)
            world->next_displacement[i] = dem2di_displaced(
                &next, world->lever[i], world->time_step, world->displacement[i] + world->rounding);
        world->before[i] = next;
        most = dem2di_max(most, dem2di_dot(next.v, next.v) * world->inverse_skin_squared[i]);
    }
    return most;
}

/* The loop for what the scene has. */
static double dem2di_integrate_block(dem2d_world *w, int b, int e) {
    const dem2di_plan *p = &w->plan;
#define DEM2DI_INTEGRATE(spin, turns)                                                           \
    (p->heavy    ? p->damped ? dem2di_integrate_range(w, b, e, true, true, spin, turns, false)  \
                             : dem2di_integrate_range(w, b, e, true, false, spin, turns, false) \
        : p->damped ? dem2di_integrate_range(w, b, e, false, true, spin, turns, false)          \
                 : dem2di_integrate_range(w, b, e, false, false, spin, turns, false))
#define DEM2DI_INTEGRATE_PUSHED(spin, turns)                                    \
    (p->damped ? dem2di_integrate_range(w, b, e, true, true, spin, turns, true) \
               : dem2di_integrate_range(w, b, e, true, false, spin, turns, true))
    if (w->loaded || w->gather != NULL)
        return p->turns  ? DEM2DI_INTEGRATE_PUSHED(true, true)
               : p->spin ? DEM2DI_INTEGRATE_PUSHED(true, false)
                         : DEM2DI_INTEGRATE_PUSHED(false, false);
    if (p->turns) return DEM2DI_INTEGRATE(true, true);
    if (p->spin) return DEM2DI_INTEGRATE(true, false);
    return DEM2DI_INTEGRATE(false, false);
#undef DEM2DI_INTEGRATE
#undef DEM2DI_INTEGRATE_PUSHED
}

static void dem2di_integrate_task(void *context, int begin, int end) {
    dem2d_world *world = (dem2d_world *)context;
    for (int block = begin; block < end; block++) {
        int first = block * DEM2DI_BLOCK;
        int last = dem2di_block_end(first, DEM2DI_BLOCK, world->body_count);
        world->block_results[block].most = dem2di_integrate_block(world, first, last);
    }
}

/* Sums of forces, velocities and positions. Returns the part of a skin used up so far: path lengths
   are sums of speeds, here of the greatest for its skin in each step. */
static double dem2di_integrate_pass(dem2d_world *world) {
    int blocks = dem2di_blocks(world->body_count, DEM2DI_BLOCK);
    double most = 0;
    world->plan.heavy = world->gravity.x != 0 || world->gravity.y != 0;
    world->plan.damped = world->local_damping > 0 || world->global_damping > 0;
    dem2di_run(world, DEM2D_PHASE_MOTION, blocks, dem2di_integrate_task, world);
    for (int k = 0; k < blocks; k++) most = dem2di_max(most, world->block_results[k].most);
    return world->list_displacement + sqrt(most) * world->time_step + world->roundoff_displacement;
}

/* The rest of the ledger, after the motion: work at the velocities before and behind. */
static void dem2di_observe_motion(dem2d_world *world, const dem2di_ledger *last) {
    dem2di_ledger *ledger = &world->ledger;
    double power[2][DEM2DI_HALVES] = {{0}};
    ledger->kinetic = 0;
    for (int place = 0; place < world->id_count; place++) {
        int slot = dem2di_slot_at(world, place);
        if (slot < 0) continue;
        dem2di_load load = dem2di_sum_of(world, slot, world->plan.spin);
        dem2di_observe_particle(world, slot, load, power, &ledger->kinetic);
    }
    for (int place = 0; place < world->wall_count; place++) {
        int j = world->walls[place].placed;
        const dem2di_wall_state *old = &world->wall_now[j], *made = &world->wall_next[j];
        if (!world->walls[j].alive) continue;
        power[0][DEM2DI_BY_WALLS] -= dem2di_dot(made->force, old->velocity);
        power[1][DEM2DI_BY_WALLS] -= dem2di_dot(made->force, made->velocity);
    }
    for (int k = 0; k < DEM2DI_HALVES; k++) {
        ledger->sum[k] += ledger->half[k] + power[0][k] * world->made_step / 2;
        ledger->half[k] = power[1][k] * world->time_step / 2;
    }
    double error = dem2di_ledger_error(ledger);
    if (ledger->edited) {
        ledger->given += error - ledger->closure;
    } else {
        ledger->turnover += dem2di_ledger_turnover(ledger, last);
        ledger->closure = error;
    }
    ledger->edited = false;
}

/* Is the next state of each particle finite if no load exceeds the greatest of this pass? */
static bool dem2di_surely_finite(const dem2d_world *world, const dem2di_count *count) {
    const double dt = world->time_step, pushed = count->load * (world->list.count + 1.0);
    double far = 0, speed = 0, spin = 0;
    if (count->unsound > world->count.unsound) return false;
    for (int i = 0; i < world->body_count; i++) {
        const dem2di_state *now = &world->now[i];
        const dem2di_inverse *inverse = &world->inverse[i];
        const dem2di_load external = dem2di_external(world, i);
        const double load = pushed + dem2di_load_size(&external);
        far = dem2di_max(far, fabs(now->x.x) + fabs(now->x.y));
        speed = dem2di_max(speed, fabs(now->v.x) + fabs(now->v.y) + dt * (load * inverse->mass));
        spin = dem2di_max(spin, fabs(now->w) + dt * (load * inverse->inertia));
    }
    speed += dt * (fabs(world->gravity.x) + fabs(world->gravity.y)); /* damping doubles at most */
    return far + 4 * dt * speed < 1e300 && 4 * dt * spin < 1e50;
}

/* A particle that the step would give a state that is not finite, or -1. */
static int dem2di_unsound(const dem2d_world *world) {
    for (int i = 0; i < world->body_count; i++) {
        dem2di_state next = dem2di_foresee(world, i);
        if (!dem2di_state_finite(&next)) return i;
    }
    return -1;
}

/* --- the stable time step -----------------------------------------------------------------------
 */

/* Stiffness of one contact on one of its particles, at one point, arm_n and arm_t from its centre.
 */
static void dem2di_stiffness_point(double kn, double kt, dem2d_vec normal, double arm_n,
                                   double arm_t, dem2di_stiffness *sum) {
    dem2di_stiffness_add(sum, kn, normal, -arm_t);
    dem2di_stiffness_add(sum, kt, dem2di_perp(normal), arm_n);
}

/* The greatest c/kn of the dashpots on a particle, s. */
static double dem2di_dashpot_lag(const dem2d_world *world, int slot) {
    const dem2di_list *list = &world->list;
    double lag = 0;
    if (!(world->plan.terms & DEM2DI_DASHPOT) || world->law != NULL) return 0;
    for (int k = list->first[slot]; k < list->first[slot + 1]; k++) {
        int i = list->adjacent[k];
        if (!(list->contacts.depth[i] > 0)) continue;
        const dem2d_pair_desc *law = dem2di_law_of(world, i);
        double inverse = dem2di_reduced_inverse(world, i);
        if (!(inverse > 0)) continue;
        lag = dem2di_max(lag, dem2di_dashpot(law, 1 / inverse) / law->normal_stiffness);
    }
    return lag;
}

/* The eigenvalue without dashpots that bounds the time step as one with them does: velocities lag
   by half a step, so that x'' = -l (x + lag x') is stable while l dt (dt + 2 lag) <= 4. */
static double dem2di_lagging(double value, double lag) {
    if (!(lag > 0 && value > 0)) return value;
    double time_step = 4 / value / (lag + sqrt(lag * lag + 4 / value));
    return 4 / (time_step * time_step);
}

/* Flatter than this many circumscribed radii counts as that: it turns by 1e-5 over the size, and
   what swings by less has less than 1e-6 of the force times the size for its energy. */
#define DEM2DI_FLATTEST 1e5

/* What the safe bound counts more of it: a load put on at once is twice what it comes to; and where
   a flat arc ends the moment stops growing: swings beyond gain energy above w dt = 1, not 2^(1/2),
   by trial (test_rocking.c). */
#define DEM2DI_ROCKING_SPARE 4

/* One of the two of a contact of one point: height of its surface along the outward normal u, and
   the radius of curvature there, or the greatest of its shape. */
static double dem2di_contact_height(const dem2d_world *world, int slot, const dem2di_state *state,
                                    dem2d_vec u, bool greatest, double *rho) {
    const dem2di_body *body = &world->bodies[slot];
    const dem2d_shape *shape = dem2di_shape_of(world, body);
    dem2d_vec v = dem2di_turn_back(state->q, u);
    double height = dem2di_dot(dem2di_support(shape, v, rho), v) * body->scale;
    if (greatest) *rho = dem2di_max(*rho, shape->rho_max);
    *rho = dem2di_min(*rho, DEM2DI_FLATTEST * shape->circumscribed) * body->scale;
    return height;
}

/* Stiffness against rocking of the partner A (side 0) or B (1) of a contact, N m. The depth is the
   least over the normals, which turn with the two. Its second derivative by the partner's angle is
   p e/(p + e), p = rho - height and e = rho of the other + height - depth, or p on a wall: what is
   flatter than a circle about the centre lifts the centre when it rolls. Times the force, it is
   beside the other stiffnesses; between two that are free it couples both angles, as they do, so
   that twice its own part bounds it. For the limit with the curvatures at a contact of one point;
   for the safe bound with the greatest, as grains come to rest on their flattest parts, and as the
   ends of straight arcs are curved. Zero for circles and corners. */
static double dem2di_rocking(const dem2d_world *world, const dem2di_state *states, int i, int side,
                             const dem2di_contact *contact, bool greatest) {
    const dem2di_list *list = &world->list;
    if (i < list->discs) return 0;
    const dem2di_key *key = &list->keys[i];
    int slot = side ? key->b : key->a, other = side ? key->a : key->b;
    const dem2d_shape *shape = dem2di_shape_of(world, &world->bodies[slot]);
    double rho, other_rho;
    if (shape->type != DEM2D_CUSTOM && !(shape->rho_max > shape->inscribed)) return 0;
    dem2d_vec u = side ? dem2di_negate(contact->normal) : contact->normal;
    double height = dem2di_contact_height(world, slot, &states[slot], u, greatest, &rho);
    double p = rho - height;
    if (!(p > 0)) return 0;
    if (i >= list->pairs) return contact->force * p;
    (void)dem2di_contact_height(world, other, &states[other], dem2di_negate(u), greatest,
                                &other_rho);
    double e = other_rho + height - contact->depth;
    return e > 0 ? contact->force * (p * (e / (p + e))) : 0;
}

/* Stiffness of the contacts of a particle for the limit (bound 0) or for the safe bound (1), which
   counts those between two free particles twice. A contact that slides does not resist, and may not
   when it rolls, or by the caller's law: it counts for the safe bound only. */
static dem2di_stiffness dem2di_stiffness_sum(const dem2d_world *world, const dem2di_state *states,
                                             int slot, int bound) {
    const dem2di_list *list = &world->list;
    dem2di_stiffness sum = {0, 0, 0, 0, 0, 0};
    for (int k = list->first[slot]; k < list->first[slot + 1]; k++) {
        int i = list->adjacent[k], side = k < list->own[slot];
        dem2di_contact contact;
        if (!dem2di_contact_get(world, &list->contacts, i, &contact)) continue;
        const dem2di_key *key = &list->keys[i];
        const dem2d_pair_desc *law = dem2di_law_of(world, i);
        const dem2di_point_pair *pair = dem2di_point_pair_of(world, &list->contacts, i);
        bool shared = i < list->pairs && world->bodies[key->a].motion == DEM2D_FREE &&
                      world->bodies[key->b].motion == DEM2D_FREE;
        bool sticks = world->law == NULL && fabs(contact.shear) < law->friction * contact.force;
        bool rubs = law->friction > 0 || world->law != NULL;
        double f = bound == 1 && shared ? 2 : 1, kn = f * law->normal_stiffness;
        double slide = sticks || (bound == 1 && rubs) ? f * law->tangential_stiffness : 0;
        double arm_n = side ? contact.arms.b_n : contact.arms.a_n;
        double arm_t = side ? contact.arms.b_t : contact.arms.a_t;
        if (bound == 1 && law->rolling_friction > 0)
            sum.rr += f * dem2di_rolling_stiffness(law, dem2di_reduced_radius(world, i));
        if (pair == NULL || bound == 1)
            sum.rr += f * (bound == 1 ? DEM2DI_ROCKING_SPARE : 1) *
                      dem2di_rocking(world, states, i, side, &contact, bound == 1);
        for (int p = 0; p < (pair != NULL ? 2 : 1); p++) {
            double w = pair != NULL ? pair->weight[p] : 1;
            double at = pair != NULL ? arm_t + pair->offset[p] : arm_t;
            dem2di_stiffness_point(w * kn, w * slide, contact.normal, arm_n, at, &sum);
        }
    }
    return sum;
}

/* The greater of what is known and one more: of equal ones that of lower rank, so that the order of
   the particles in memory does not matter. */
static void dem2di_stiffest_meet(const dem2d_world *world, dem2di_stiffest *so_far, int bound,
                                 double value, int slot) {
    bool equal = value == so_far->value[bound] && slot >= 0 && so_far->at[bound] >= 0;
    if (!(value > so_far->value[bound]) &&
        !(equal && world->bodies[slot].rank < world->bodies[so_far->at[bound]].rank))
        return;
    so_far->value[bound] = value;
    so_far->at[bound] = slot;
}

/* Over free particles, which were in these states at the force pass; with `loose` those without a
   contact count for the safe bound as if they had one with their own kind. Eigenvalues below
   `enough` need not be known: their sum bounds them, and that of the safe bound the one of the
   limit. */
static void dem2di_stiffest_range(const dem2d_world *world, const dem2di_state *states, int begin,
                                  int end, bool loose, double enough, dem2di_stiffest *stiffest) {
    stiffest->value[0] = stiffest->value[1] = 0;
    stiffest->at[0] = stiffest->at[1] = -1;
    for (int i = begin; i < end; i++) {
        const dem2di_body *body = &world->bodies[i];
        if (body->shape_index < 0 || body->motion != DEM2D_FREE) continue;
        double mass = dem2di_body_mass(world, body), inertia = dem2di_body_inertia(world, body);
        double lag = dem2di_dashpot_lag(world, i);
        bool touched = false;
        for (int bound = 1; bound >= 0; bound--) {
            const dem2di_stiffness k = dem2di_stiffness_sum(world, states, i, bound);
            double value = (k.xx + k.yy) / mass + k.rr / inertia;
            touched = touched || k.xx + k.yy > 0;
            if (touched && (value > enough || lag > 0))
                value = dem2di_largest_eigenvalue(&k, mass, inertia);
            if (bound == 1) value = dem2di_lagging(value, lag);
            dem2di_stiffest_meet(world, stiffest, bound, value, i);
            if (value <= enough) break;
        }
        if (!loose || touched) continue;
        const dem2d_pair_desc *law = dem2di_law(world, body->material, body->material);
        double arm = world->now[i].radius * world->now[i].radius / inertia;
        double kt = law->friction > 0 ? law->tangential_stiffness : 0;
        double value = 2 * dem2di_max(law->normal_stiffness, kt) * (1 / mass + arm);
        dem2di_stiffest_meet(world, stiffest, 1, value, i);
    }
}

/* --- the check of the time step and of the speeds ------------------------------------------------
   Made in the first step, in the next step after an edit that can matter, and in every so many
   steps. It does not depend on when the list is rebuilt. */

/* The one of lower rank of two slots; -1 is none. */
static int dem2di_first_of(const dem2d_world *world, int one, int other) {
    if (one < 0 || other < 0) return one < 0 ? other : one;
    return world->bodies[one].rank < world->bodies[other].rank ? one : other;
}

static void dem2di_check_task(void *context, int begin, int end) {
    dem2d_world *world = (dem2d_world *)context;
    double enough = 4 / (world->time_step * world->time_step);
    for (int block = begin; block < end; block++) {
        int first = block * DEM2DI_BLOCK, fast = -1;
        int last = dem2di_block_end(first, DEM2DI_BLOCK, world->body_count);
        for (int i = first; i < last; i++)
            if (dem2di_outruns(world, i)) fast = dem2di_first_of(world, fast, i);
        world->block_results[block].fast = fast;
        if (world->check_time_step && !dem2di_is_soft(world, world->softness))
            dem2di_stiffest_range(world, world->now, first, last, false, enough,
                                  &world->block_results[block].stiffest);
    }
}

/* Is there a particle that may pass through others? The first time the log is told. */
static bool dem2di_check_motions(const dem2d_world *world) {
    int fast = -1;
    for (int k = 0; k < dem2di_blocks(world->body_count, DEM2DI_BLOCK); k++)
        fast = dem2di_first_of(world, fast, world->block_results[k].fast);
    if (fast >= 0 && world->fast_motion == 0)
        (void)dem2di_fail(&world->env, DEM2D_WARNING, world->bodies[fast].index,
                          "particle %d moves by more than its inscribed radius in a step: it may "
                          "pass through others",
                          world->bodies[fast].index);
    return fast >= 0;
}

/* The step that is about to be made against both bounds: beyond the greater one it is refused,
   between the two it is noted. */
static dem2d_result dem2di_check_stiffness(const dem2d_world *world, bool *slow) {
    double dt = world->time_step;
    dem2di_stiffest all = {{0, 0}, {-1, -1}};
    for (int k = 0; k < dem2di_blocks(world->body_count, DEM2DI_BLOCK); k++)
        for (int bound = 0; bound < 2; bound++) {
            const dem2di_stiffest *one = &world->block_results[k].stiffest;
            dem2di_stiffest_meet(world, &all, bound, one->value[bound], one->at[bound]);
        }
    int particle[2];
    for (int bound = 0; bound < 2; bound++)
        particle[bound] = all.at[bound] >= 0 ? world->bodies[all.at[bound]].index : -1;
    if (dt * dt * all.value[0] > 4)
        return dem2di_fail(&world->env, DEM2D_TIME_STEP, particle[0],
                           "time_step = %g is above the limit %g of particle %d", dt,
                           2 / sqrt(all.value[0]), particle[0]);
    *slow = dt * dt * all.value[1] > 4;
    if (*slow && world->slow_time_step == 0)
        (void)dem2di_fail(&world->env, DEM2D_WARNING, particle[1],
                          "time_step = %g may be unstable: %g is safe (particle %d)", dt,
                          2 / sqrt(all.value[1]), particle[1]);
    return DEM2D_OK;
}

/* Of the step that is about to be made, whose contacts are known. */
static dem2d_result dem2di_check_step(dem2d_world *world, bool *slow, bool *fast) {
    dem2di_run(world, DEM2D_PHASE_LIST, dem2di_blocks(world->body_count, DEM2DI_BLOCK),
               dem2di_check_task, world);
    *fast = dem2di_check_motions(world);
    if (!world->check_time_step || dem2di_is_soft(world, world->softness)) return DEM2D_OK;
    return dem2di_check_stiffness(world, slow);
}

DEM2D_API dem2d_result dem2d_world_time_step_bounds(const dem2d_world *world, double *safe,
                                                    double *limit,
                                                    dem2d_particle_id *limit_particle) {
    if (world == NULL || safe == NULL || limit == NULL) return DEM2D_NULL_ARGUMENT;
    dem2di_stiffest all;
    dem2di_stiffest_range(world, world->before, 0, world->body_count, true, 0, &all);
    *safe = all.value[1] > 0 ? 2 / sqrt(all.value[1]) : HUGE_VAL;
    *limit = all.value[0] > 0 ? 2 / sqrt(all.value[0]) : HUGE_VAL;
    if (limit_particle == NULL) return DEM2D_OK;
    limit_particle->index = limit_particle->generation = 0;
    if (all.at[0] >= 0) *limit_particle = dem2di_particle_id(world, all.at[0]);
    return DEM2D_OK;
}

/* --- the step ------------------------------------------------------------------------------------
 */

/* A step has been made, and nobody has been given other velocities since. */
static void dem2di_made(dem2d_world *world) {
    for (int i = 0; i < world->body_count && world->redirected; i++)
        world->bodies[i].redirected = false;
    world->redirected = false;
    world->made_step = world->time_step;
}

/* Everything new becomes the present; the present becomes the state of the last force pass. */
static void dem2di_commit(dem2d_world *world) {
    dem2di_columns_swap(world);
    for (int j = 0; j < world->wall_count; j++)
        if (world->walls[j].desc.mode != DEM2D_WALL_STILL) dem2di_surfaces_set(world, j);
    dem2di_made(world);
    world->steps++;
    world->tree.made = false;
}

/* Would the step give a particle or a wall a state that is not finite? */
static dem2d_result dem2di_check_states(const dem2d_world *world, const dem2di_count *count) {
    bool free_hand = world->gather != NULL; /* the caller may have put anything into the sums */
    bool known = !free_hand && world->bounded && count->unsound == world->count.unsound;
    bool sure = known || (!free_hand && dem2di_surely_finite(world, count));
    int slot = sure ? -1 : dem2di_unsound(world);
    if (slot >= 0)
        return dem2di_fail(&world->env, DEM2D_STATE, world->bodies[slot].index,
                           "particle %d would get a state that is not finite",
                           world->bodies[slot].index);
    for (int j = 0; j < world->wall_count; j++)
        if (world->walls[j].alive &&
            !(dem2di_vec_finite(world->wall_next[j].point) &&
              dem2di_finite(world->wall_next[j].drift) &&
              (!free_hand || dem2di_vec_finite(world->wall_next[j].force))))
            return dem2di_fail(&world->env, DEM2D_STATE, j,
                               "wall %d would get a place or a speed that is not finite", j);
    return DEM2D_OK;
}

/* What a step has found before anything of it is kept. */
typedef struct dem2di_trial {
    dem2di_count count;
    bool listed, back, slow, fast, used_up; /* back: the last contacts can be put back */
} dem2di_trial;

/* The passes that may be refused, up to the last check. */
static dem2d_result dem2di_step_try(dem2d_world *world, dem2di_trial *trial) {
    if (world->set_loads != NULL) world->set_loads(world->loads_user, world);
    dem2d_result result = dem2di_prepare(world, &trial->listed);
    if (result != DEM2D_OK) return result;
    world->list_stale = trial->listed; /* if the step fails, the next try builds a list as well */
    bool due = dem2di_check_is_due(world);
    bool back = dem2di_looks_back(world, &world->plan, world->bounded, world->softness);
    if (!dem2di_sums_reserve(world)) return dem2di_out_of_memory(world, "sums of forces");
    if (back && !dem2di_keep_last(world)) return dem2di_out_of_memory(world, "contacts");
    world->keeps_last = trial->back = back;
    dem2di_force_pass(world, &trial->count);
    if (due) result = dem2di_check_step(world, &trial->slow, &trial->fast);
    if (result != DEM2D_OK) return result;
    dem2di_wall_sums(world);
    dem2di_gather_pass(world);
    trial->used_up = dem2di_control_pass(world);
    return dem2di_check_states(world, &trial->count);
}

/* One step, pass by pass: see the head of the world's section. What can be refused is so before the
   next states come over those of the last force pass: only the contacts have to be put back. */
static dem2d_result dem2di_step(dem2d_world *world) {
    dem2di_trial trial;
    memset(&trial, 0, sizeof trial);
    trial.count = world->count;
    dem2d_result result = dem2di_step_try(world, &trial), agreed = DEM2D_OK;
    if (world->commit != NULL) agreed = world->commit(world->exchange_user, result);
    if (result == DEM2D_OK) result = agreed;
    if (result != DEM2D_OK) {
        if (trial.back) dem2di_contacts_keep(world, 0, world->list.count, true);
        return result;
    }
    const dem2di_ledger ledger = world->ledger;
    if (ledger.kept) dem2di_observe_contacts(world); /* nothing fails from here on */
    double path = dem2di_integrate_pass(world);
    if (ledger.kept) dem2di_observe_motion(world, &ledger);
    bool used_up = trial.used_up || path > 1 - DEM2DI_LIST_STEPS * DBL_EPSILON ||
                   world->steps - world->listed_at >= DEM2DI_LIST_STEPS;
    world->plan.terms_made = world->plan.terms_now;
    if (world->plan_due > 0) world->plan_due--;
    world->list_displacement = path;
    world->list_stale = world->list_used_up = used_up;
    world->rebuilds += trial.listed;
    world->count = trial.count;
    world->slow_time_step += trial.slow;
    world->fast_motion += trial.fast;
    world->check_due = false;
    dem2di_commit(world);
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_step(dem2d_world *world, int count, int *done) {
    if (done != NULL) *done = 0;
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_number(&world->env, "count", count, DEM2DI_COUNT);
    if (world->stepping)
        result = dem2di_fail(&world->env, DEM2D_IN_USE, -1, "step called by a callback of a step");
    if (result != DEM2D_OK) return result;
    world->stepping = true;
    for (int i = 0; i < count && result == DEM2D_OK; i++) {
        result = dem2di_step(world);
        if (done != NULL && result == DEM2D_OK) *done = i + 1;
    }
    world->stepping = false;
    return result;
}

/* ============================================================================================
   >>measures  Lists of what is there, energy, stress, fabric, packing, distance from rest
   uses: config, math, memory, fields, mass, shapes, broad, law, motion, world, objects
   ============================================================================================ */

/* Slot of the next particle in the order of ranks, or -1; `place` starts at 0. */
static int dem2di_next_particle(const dem2d_world *world, int *place) {
    while (*place < world->id_count) {
        int slot = dem2di_slot_at(world, (*place)++);
        if (slot >= 0) return slot;
    }
    return -1;
}

/* An iterator over the contacts of the last force pass in the order of ranks: those of particles,
   then, unless they are left out, those with walls. */
typedef struct dem2di_contact_iterator {
    bool pairs_only, walls; /* without walls; with walls now */
    int place, entry;       /* where it goes on */
    int number;             /* where it is, and the contact there */
    dem2di_contact contact;
    dem2d_vec branch; /* from A's centre to B's; to a wall: the contact point */
} dem2di_contact_iterator;

static bool dem2di_next_of_kind(const dem2d_world *world, dem2di_contact_iterator *iterator) {
    const dem2di_list *list = &world->list;
    for (; iterator->place < world->id_count; iterator->place++, iterator->entry = 0) {
        int slot = dem2di_slot_at(world, iterator->place);
        if (slot < 0) continue;
        while (list->own[slot] + iterator->entry < list->first[slot + 1]) {
            int i = list->adjacent[list->own[slot] + iterator->entry++];
            if ((i >= list->pairs) != iterator->walls) continue;
            if (!dem2di_contact_get(world, &list->contacts, i, &iterator->contact)) continue;
            iterator->number = i;
            iterator->branch = dem2di_branch_of(&iterator->contact, iterator->walls);
            return true;
        }
    }
    return false;
}

static bool dem2di_next_contact(const dem2d_world *world, dem2di_contact_iterator *iterator) {
    if (dem2di_next_of_kind(world, iterator)) return true;
    if (iterator->walls || iterator->pairs_only) return false;
    iterator->walls = true;
    iterator->place = iterator->entry = 0;
    return dem2di_next_of_kind(world, iterator);
}

static dem2di_contact_iterator dem2di_contacts_start(bool pairs_only) {
    dem2di_contact_iterator iterator;
    memset(&iterator, 0, sizeof iterator);
    iterator.pairs_only = pairs_only;
    return iterator;
}

static int dem2di_open_contacts(const dem2d_world *world, int begin, int end) {
    int open = 0;
    for (int i = begin; i < end; i++) open += world->list.contacts.depth[i] > 0;
    return open;
}

DEM2D_API dem2d_result dem2d_world_stats(const dem2d_world *world, dem2d_stats *stats) {
    if (world == NULL || stats == NULL) return DEM2D_NULL_ARGUMENT;
    stats->steps = world->steps;
    stats->time = dem2di_time(world);
    stats->list_rebuilds = world->rebuilds;
    stats->support_calls = world->count.calls;
    stats->collisions = world->count.collisions;
    stats->separations = world->count.separations;
    memcpy(stats->proofs, world->count.proofs, sizeof stats->proofs);
    stats->not_converged = world->count.proofs[DEM2D_BY_NOTHING];
    stats->slow_time_step = world->slow_time_step;
    stats->fast_motion = world->fast_motion;
    stats->particles = world->body_count - world->holes;
    stats->walls = 0;
    for (int j = 0; j < world->wall_count; j++) stats->walls += world->walls[j].alive;
    stats->pairs = world->list.count;
    stats->contacts = dem2di_open_contacts(world, 0, world->list.pairs);
    stats->wall_contacts = dem2di_open_contacts(world, world->list.pairs, world->list.count);
    stats->skin = world->skin;
    stats->bytes = world->bytes;
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_particles(const dem2d_world *world, dem2d_particle_id *ids,
                                             int capacity, int *count) {
    if (world == NULL || count == NULL) return DEM2D_NULL_ARGUMENT;
    if (ids == NULL && capacity > 0) return dem2di_fail_null(&world->env, "ids");
    if (capacity < 0)
        return dem2di_fail(&world->env, DEM2D_OUT_OF_RANGE, -1, "capacity = %d", capacity);
    int alive = 0;
    for (int index = 0; index < world->id_count; index++) {
        int slot = world->ids[index].slot;
        if (slot >= 0 && alive < capacity) ids[alive] = dem2di_particle_id(world, slot);
        alive += slot >= 0;
    }
    *count = alive;
    return DEM2D_OK;
}

static dem2d_contact_info dem2di_contact_of(const dem2d_world *world,
                                            const dem2di_contact_iterator *iterator) {
    const dem2di_key *key = &world->list.keys[iterator->number];
    const dem2di_contact *contact = &iterator->contact;
    dem2d_contact_info info;
    memset(&info, 0, sizeof info);
    info.a = dem2di_particle_id(world, key->a);
    if (iterator->walls) {
        int wall = dem2di_wall_of(world, iterator->number);
        info.wall = dem2di_wall_id(world, wall);
        info.part_b = key->b - world->walls[wall].first;
    } else {
        info.b = dem2di_particle_id(world, key->b);
    }
    info.sign = 1;
    info.normal = contact->normal;
    info.point = dem2di_add(world->before[key->a].x, dem2di_arm_a(contact));
    info.branch = iterator->branch;
    info.points =
        dem2di_point_pair_of(world, &world->list.contacts, iterator->number) != NULL ? 2 : 1;
    info.depth = contact->depth;
    info.normal_force = contact->force;
    info.tangential_force = contact->shear;
    info.moment = dem2di_moment_of(world, &world->list.contacts, iterator->number);
    return info;
}

DEM2D_API dem2d_result dem2d_world_contacts(const dem2d_world *world, dem2d_contact_info *contacts,
                                            int capacity, int *count) {
    if (world == NULL || count == NULL) return DEM2D_NULL_ARGUMENT;
    if (contacts == NULL && capacity > 0) return dem2di_fail_null(&world->env, "contacts");
    if (capacity < 0)
        return dem2di_fail(&world->env, DEM2D_OUT_OF_RANGE, -1, "capacity = %d", capacity);
    int open = 0;
    dem2di_contact_iterator iterator = dem2di_contacts_start(false);
    for (; dem2di_next_contact(world, &iterator); open++)
        if (open < capacity) contacts[open] = dem2di_contact_of(world, &iterator);
    *count = open;
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_energy(const dem2d_world *world, dem2d_energy *energy) {
    if (world == NULL || energy == NULL) return DEM2D_NULL_ARGUMENT;
    memset(energy, 0, sizeof *energy);
    for (int place = 0, i; (i = dem2di_next_particle(world, &place)) >= 0;) {
        const dem2di_body *body = &world->bodies[i];
        double mass = dem2di_body_mass(world, body), inertia = dem2di_body_inertia(world, body);
        for (int k = 0; k < 2; k++) {
            dem2di_velocities half =
                k == 0 ? dem2di_velocities_of(&world->before[i]) : dem2di_velocities_made(world, i);
            energy->translational += mass * dem2di_dot(half.v, half.v) / 4;
            energy->rotational += inertia * half.w * half.w / 4;
        }
        energy->potential -= mass * dem2di_dot(world->gravity, world->before[i].x);
    }
    dem2di_contact_iterator iterator = dem2di_contacts_start(false);
    while (dem2di_next_contact(world, &iterator)) {
        dem2di_stored part =
            dem2di_stored_in(world, &world->list.contacts, iterator.number, &iterator.contact);
        energy->normal += part.normal;
        energy->tangential += part.tangential;
        energy->rolling += part.rolling;
    }
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_ledger(const dem2d_world *world, dem2d_ledger *ledger) {
    if (world == NULL || ledger == NULL) return DEM2D_NULL_ARGUMENT;
    const dem2di_ledger *own = &world->ledger;
    if (!own->kept)
        return dem2di_fail(&world->env, DEM2D_OUT_OF_RANGE, -1, "ledger: this world keeps none");
    ledger->kinetic = own->kinetic;
    ledger->normal = own->stored.normal;
    ledger->tangential = own->stored.tangential + own->stored.rolling;
    ledger->gravity = own->sum[DEM2DI_GRAVITY];
    ledger->walls = own->sum[DEM2DI_BY_WALLS];
    ledger->driven = own->sum[DEM2DI_DRIVING];
    ledger->friction = own->sum[DEM2DI_BY_FRICTION];
    ledger->dashpot = own->sum[DEM2DI_BY_DASHPOTS];
    ledger->damping = own->sum[DEM2DI_BY_DAMPING];
    ledger->given = own->given;
    ledger->closure = own->closure;
    ledger->turnover = own->turnover;
    ledger->loads = own->sum[DEM2DI_BY_LOADS];
    return DEM2D_OK;
}

static void dem2di_stress_add(dem2d_stress *sum, dem2d_vec arm, dem2d_vec force) {
    sum->xx += arm.x * force.x;
    sum->xy += arm.x * force.y;
    sum->yx += arm.y * force.x;
    sum->yy += arm.y * force.y;
}

static dem2d_stress dem2di_stress_over(const dem2d_stress *sum, double area) {
    dem2d_stress stress;
    stress.xx = sum->xx / area;
    stress.xy = sum->xy / area;
    stress.yx = sum->yx / area;
    stress.yy = sum->yy / area;
    return stress;
}

DEM2D_API dem2d_result dem2d_world_stress(const dem2d_world *world, double area,
                                          dem2d_stress *stress) {
    if (world == NULL || stress == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_number(&world->env, "area", area, DEM2DI_POSITIVE);
    if (result != DEM2D_OK) return result;
    dem2d_stress sum = {0, 0, 0, 0};
    dem2di_contact_iterator iterator = dem2di_contacts_start(false);
    while (dem2di_next_contact(world, &iterator))
        dem2di_stress_add(&sum, iterator.branch, dem2di_contact_force(&iterator.contact));
    *stress = dem2di_stress_over(&sum, area);
    return DEM2D_OK;
}

static double dem2di_body_area(const dem2d_world *world, const dem2di_body *body) {
    return dem2di_shape_of(world, body)->mass.area * body->scale * body->scale;
}

/* The arm points from the centre to the contact; what pushes there pushes against the arm. */
static dem2d_stress dem2di_particle_stress(const dem2d_world *world, int slot) {
    const dem2di_list *list = &world->list;
    dem2d_stress sum = {0, 0, 0, 0};
    for (int k = list->first[slot]; k < list->first[slot + 1]; k++) {
        dem2di_contact contact;
        if (!dem2di_contact_get(world, &list->contacts, list->adjacent[k], &contact)) continue;
        dem2d_vec force = dem2di_contact_force(&contact);
        if (k < list->own[slot])
            dem2di_stress_add(&sum, dem2di_negate(dem2di_arm_b(&contact)), force);
        else
            dem2di_stress_add(&sum, dem2di_arm_a(&contact), force);
    }
    return dem2di_stress_over(&sum, dem2di_body_area(world, &world->bodies[slot]));
}

DEM2D_API dem2d_result dem2d_world_particle_stress(const dem2d_world *world, dem2d_particle_id id,
                                                   dem2d_stress *stress) {
    if (world == NULL || stress == NULL) return DEM2D_NULL_ARGUMENT;
    int slot = dem2di_slot(world, id);
    if (slot < 0) return dem2di_stale(world, "particle", id.index);
    *stress = dem2di_particle_stress(world, slot);
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_stress_principal(const dem2d_stress *stress,
                                              dem2d_principal *principal) {
    if (stress == NULL || principal == NULL) return DEM2D_NULL_ARGUMENT;
    if (!dem2di_finite(stress->xx) || !dem2di_finite(stress->xy) || !dem2di_finite(stress->yx) ||
        !dem2di_finite(stress->yy))
        return DEM2D_NOT_FINITE;
    dem2di_tensor symmetric;
    symmetric.xx = stress->xx;
    symmetric.xy = stress->xy / 2 + stress->yx / 2;
    symmetric.yy = stress->yy;
    *principal = dem2di_tensor_principal(symmetric);
    return DEM2D_OK;
}

DEM2D_API double dem2d_strain(double now, double before) {
    if (!dem2di_finite(now) || !dem2di_finite(before) || !(now > 0 && before > 0))
        return (double)NAN;
    return now > before ? -dem2di_log_ratio(now, before) : dem2di_log_ratio(before, now);
}

/* Contacts of a particle with others. */
static int dem2di_contacts_of(const dem2d_world *world, int slot) {
    const dem2di_list *list = &world->list;
    int open = 0;
    for (int k = list->first[slot]; k < list->first[slot + 1]; k++) {
        int contact = list->adjacent[k];
        if (contact < list->pairs) open += dem2di_open_contacts(world, contact, contact + 1);
    }
    return open;
}

/* Radius of the smaller particle of a contact. */
static double dem2di_smaller_radius(const dem2d_world *world,
                                    const dem2di_contact_iterator *iterator) {
    const dem2di_key *key = &world->list.keys[iterator->number];
    double radius = dem2di_equivalent(world, key->a);
    return iterator->walls ? radius : dem2di_min(radius, dem2di_equivalent(world, key->b));
}

DEM2D_API dem2d_result dem2d_world_packing(const dem2d_world *world, dem2d_packing *packing) {
    if (world == NULL || packing == NULL) return DEM2D_NULL_ARGUMENT;
    double ends = 0, loaded_ends = 0, overlap = 0, greatest = 0, area = 0;
    int alive = 0, loaded = 0, open = 0;
    for (int place = 0, slot; (slot = dem2di_next_particle(world, &place)) >= 0; alive++) {
        int contacts = dem2di_contacts_of(world, slot);
        ends += contacts;
        loaded += contacts >= 2;
        if (contacts >= 2) loaded_ends += contacts;
        area += dem2di_body_area(world, &world->bodies[slot]);
    }
    dem2di_contact_iterator iterator = dem2di_contacts_start(false);
    while (dem2di_next_contact(world, &iterator)) {
        double relative = iterator.contact.depth / dem2di_smaller_radius(world, &iterator);
        greatest = dem2di_max(greatest, relative);
        if (iterator.walls) continue;
        overlap += relative;
        open++;
    }
    packing->coordination = alive > 0 ? ends / alive : 0;
    packing->coordination_loaded = loaded > 0 ? loaded_ends / loaded : 0;
    packing->mean_overlap = open > 0 ? overlap / open : 0;
    packing->max_overlap = greatest;
    packing->solid_area = area;
    packing->rattlers = alive - loaded;
    return DEM2D_OK;
}

static double dem2di_clamp(double a, double low, double high) {
    return dem2di_max(low, dem2di_min(a, high));
}

/* Mean of y held between low and high while it goes evenly from a to b. */
static double dem2di_mean_held(double a, double b, double low, double high) {
    double p = dem2di_clamp(a, low, high), q = dem2di_clamp(b, low, high);
    if (p == q || (p == a && q == b)) return (p + q) / 2;
    return (p * (p - a) + (p + q) / 2 * (q - p) + q * (b - q)) / (b - a);
}

/* Integral of y dx, held within a box, along the edge from p to q. Summed around a polygon against
   the clock it is the area of its part inside; no polygon is stored for that. */
static double dem2di_edge_held(dem2d_vec p, dem2d_vec q, const dem2d_box *box) {
    double left = dem2di_clamp(p.x, box->lower.x, box->upper.x);
    double right = dem2di_clamp(q.x, box->lower.x, box->upper.x);
    if (left == right) return 0;
    double rise = (q.y - p.y) / (q.x - p.x);
    double a = left == p.x ? p.y : p.y + (left - p.x) * rise;
    double b = right == q.x ? q.y : q.y + (right - q.x) * rise;
    return (right - left) * dem2di_mean_held(a, b, box->lower.y, box->upper.y);
}

/* Part of a shape's outline polygon inside a box about its centre. */
static double dem2di_part_inside(const dem2d_shape *shape, const dem2d_pose *pose,
                                 const dem2d_box *box) {
    int points = dem2di_fine_count(shape);
    dem2d_pose centred = *pose;
    centred.position = dem2di_vec(0, 0);
    double inside = 0;
    dem2d_vec p = dem2di_place(&centred, dem2di_outline_point(shape, 0, points));
    for (int i = 1; i <= points; i++) {
        dem2d_vec q = dem2di_place(&centred, dem2di_outline_point(shape, i % points, points));
        inside -= dem2di_edge_held(p, q, box);
        p = q;
    }
    double all = dem2di_mass_interpolated(shape, points).area * pose->scale * pose->scale;
    return dem2di_clamp(inside / all, 0, 1);
}

/* Area of a particle inside a region. The region is taken about the particle's centre, and no
   larger than its box, so that neither its size nor its distance costs digits. */
static double dem2di_area_inside(const dem2d_world *world, int slot, const dem2d_box *region) {
    const dem2di_body *body = &world->bodies[slot];
    const dem2d_shape *shape = dem2di_shape_of(world, body);
    dem2d_pose pose = dem2di_pose_of(world, world->before, slot), centred = pose;
    double area = dem2di_body_area(world, body);
    dem2d_box box, part;
    centred.position = dem2di_vec(0, 0);
    (void)dem2d_shape_aabb(shape, centred, &box);
    part.lower.x = dem2di_max(box.lower.x, region->lower.x - pose.position.x);
    part.lower.y = dem2di_max(box.lower.y, region->lower.y - pose.position.y);
    part.upper.x = dem2di_min(box.upper.x, region->upper.x - pose.position.x);
    part.upper.y = dem2di_min(box.upper.y, region->upper.y - pose.position.y);
    if (!(part.lower.x < part.upper.x && part.lower.y < part.upper.y)) return 0;
    if (part.lower.x == box.lower.x && part.lower.y == box.lower.y && part.upper.x == box.upper.x &&
        part.upper.y == box.upper.y)
        return area;
    return area * dem2di_part_inside(shape, &pose, &part);
}

static dem2d_result dem2di_check_region(const dem2d_env *env, const dem2d_box *region) {
    dem2d_result result = dem2di_check_vec(env, "region.lower", region->lower);
    if (result == DEM2D_OK) result = dem2di_check_vec(env, "region.upper", region->upper);
    if (result != DEM2D_OK) return result;
    double width = region->upper.x - region->lower.x, height = region->upper.y - region->lower.y;
    if (width > 0 && height > 0 && width * height > 0 && dem2di_finite(width * height))
        return DEM2D_OK;
    return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "region of %g by %g", width, height);
}

DEM2D_API dem2d_result dem2d_world_porosity(const dem2d_world *world, const dem2d_box *region,
                                            double *porosity) {
    if (world == NULL || region == NULL || porosity == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result = dem2di_check_region(&world->env, region);
    if (result != DEM2D_OK) return result;
    double solid = 0;
    for (int place = 0, slot; (slot = dem2di_next_particle(world, &place)) >= 0;)
        solid += dem2di_area_inside(world, slot, region);
    double width = region->upper.x - region->lower.x, height = region->upper.y - region->lower.y;
    *porosity = 1 - solid / (width * height);
    return DEM2D_OK;
}

/* --- fabric -------------------------------------------------------------------------------------
 */

/* A quantity f0 (1 + a cos 2 (t - t0)) has the mean of f n n over all directions t of
   f0/2 (1 +- a/2) along its axes: the deviator q is f0 a/4. The number of contacts is one with
   f0 = 1. A tangential f = -f0 a sin 2 (t - t0), along n turned by +90 degrees, t, has the
   symmetric mean of f (t n + n t)/2 with
       xx = -mean of f sin 2t/2 = f0 a/4 cos 2 t0 = -yy,   xy = mean of f cos 2t/2 = f0 a/4 sin 2 t0
   which is q = f0 a/4 along t0 once more. */
static dem2d_anisotropy dem2di_anisotropy(dem2di_tensor mean, double f0) {
    dem2d_principal principal = dem2di_tensor_principal(mean);
    dem2d_anisotropy none = {0, 0}, found;
    found.coefficient = 4 * principal.q / f0;
    found.direction = principal.angle;
    return f0 > 0 && principal.q > 0 ? found : none;
}

/* cos 2 (t - t0) of a unit vector to an axis. */
static double dem2di_cos_twice(dem2d_vec n, dem2d_rot axis) {
    double along = n.x * axis.c + n.y * axis.s, across = n.y * axis.c - n.x * axis.s;
    return (along - across) * (along + across);
}

/* Least relative number of contacts in a direction that means are corrected by: above a_c = 0.9
   the second order foretells none or less somewhere, and the few contacts there would outweigh all
   others. */
#define DEM2DI_DENSITY_LEAST 0.1

/* Means over contacts, with and without the correction for their number by direction. */
typedef struct dem2di_fabric_sums {
    int count;
    double branch, force;
    dem2di_tensor normals, branches, branch_tangents, normal_forces, tangential_forces;
} dem2di_fabric_sums;

/* Sums with the density of contacts 1 + coefficient cos 2 (t - t0). */
static dem2di_fabric_sums dem2di_fabric_sum(const dem2d_world *world, dem2d_anisotropy density) {
    dem2di_fabric_sums sums;
    dem2d_rot axis = dem2d_rot_make(density.direction);
    dem2di_contact_iterator iterator = dem2di_contacts_start(true);
    memset(&sums, 0, sizeof sums);
    for (; dem2di_next_contact(world, &iterator); sums.count++) {
        const dem2di_contact *contact = &iterator.contact;
        dem2d_vec n = contact->normal;
        double weight = 1 + density.coefficient * dem2di_cos_twice(n, axis);
        double length = dem2di_dot(iterator.branch, n);
        weight = dem2di_max(weight, DEM2DI_DENSITY_LEAST);
        sums.branch += length;
        sums.force += contact->force;
        dem2di_tensor_add(&sums.normals, 1, n, n);
        dem2di_tensor_add(&sums.branches, length / weight, n, n);
        dem2di_tensor_add(&sums.branch_tangents, dem2di_cross(n, iterator.branch) / weight, n,
                          dem2di_perp(n));
        dem2di_tensor_add(&sums.normal_forces, contact->force / weight, n, n);
        dem2di_tensor_add(&sums.tangential_forces, contact->shear / weight, n, dem2di_perp(n));
    }
    return sums;
}

/* Part of an anisotropy along an axis. */
static double dem2di_anisotropy_along(dem2d_anisotropy a, dem2d_rot axis) {
    dem2d_rot own = dem2d_rot_make(a.direction);
    return a.coefficient * dem2di_cos_twice(dem2di_vec(own.c, own.s), axis);
}

DEM2D_API dem2d_result dem2d_world_fabric(const dem2d_world *world, dem2d_fabric *fabric) {
    if (world == NULL || fabric == NULL) return DEM2D_NULL_ARGUMENT;
    memset(fabric, 0, sizeof *fabric);
    dem2di_fabric_sums sums = dem2di_fabric_sum(world, fabric->normals);
    int count = fabric->contacts = sums.count;
    if (count == 0) return DEM2D_OK;
    fabric->xx = sums.normals.xx / count;
    fabric->xy = sums.normals.xy / count;
    fabric->yy = sums.normals.yy / count;
    fabric->mean_branch = sums.branch / count;
    fabric->mean_force = sums.force / count;
    fabric->normals = dem2di_anisotropy(sums.normals, count);
    fabric->deviator = fabric->normals.coefficient / 2;
    sums = dem2di_fabric_sum(world, fabric->normals);
    double force = sums.normal_forces.xx + sums.normal_forces.yy;
    double branch = sums.branches.xx + sums.branches.yy;
    fabric->branches = dem2di_anisotropy(sums.branches, branch);
    fabric->branch_tangents = dem2di_anisotropy(sums.branch_tangents, branch);
    fabric->normal_forces = dem2di_anisotropy(sums.normal_forces, force);
    fabric->tangential_forces = dem2di_anisotropy(sums.tangential_forces, force);
    dem2d_rot axis = dem2d_rot_make(fabric->normals.direction);
    const dem2d_anisotropy parts[5] = {fabric->normals, fabric->branches, fabric->branch_tangents,
                                       fabric->normal_forces, fabric->tangential_forces};
    for (int i = 0; i < 5; i++) fabric->stress_ratio += dem2di_anisotropy_along(parts[i], axis) / 2;
    return DEM2D_OK;
}

/* --- histograms ---------------------------------------------------------------------------------
 */

/* The bin of a direction among those that share out a turn (or half a turn, and then of an axis).
 */
static int dem2di_bin(dem2d_vec direction, double turn, int bins) {
    dem2d_rot q;
    q.c = direction.x;
    q.s = direction.y;
    double angle = dem2d_rot_angle(q);
    if (angle < 0) angle += turn;
    if (angle >= turn) angle -= turn;
    int bin = (int)(angle / turn * bins);
    return bin < bins ? bin : bins - 1; /* -1e-20 plus a turn is a turn */
}

static void dem2di_bin_coordination(const dem2d_world *world, int bins, int *counts) {
    for (int place = 0, slot; (slot = dem2di_next_particle(world, &place)) >= 0;) {
        int contacts = dem2di_contacts_of(world, slot);
        counts[contacts < bins ? contacts : bins - 1]++;
    }
}

/* The axes of the templates come first: many particles share one. Zero for none. */
static void dem2di_bin_orientation(const dem2d_world *world, int bins, dem2d_rot *axes,
                                   int *counts) {
    for (int t = 0; t < world->template_count; t++) {
        double ratio = 1, angle = 0;
        if (world->templates[t].shape != NULL)
            angle = dem2di_axis(world->templates[t].shape, &ratio);
        axes[t] = dem2d_rot_make(angle);
        if (ratio == 1) axes[t].c = axes[t].s = 0;
    }
    for (int place = 0, slot; (slot = dem2di_next_particle(world, &place)) >= 0;) {
        dem2d_rot axis = axes[world->bodies[slot].shape_index];
        dem2d_pose pose = dem2di_pose_of(world, world->before, slot);
        if (axis.c == 0 && axis.s == 0) continue;
        dem2d_vec along = dem2di_turn(pose.rotation, dem2di_vec(axis.c, axis.s));
        counts[dem2di_bin(along, DEM2DI_PI, bins)]++;
    }
}

/* What a contact adds to its two bins. */
static double dem2di_binned(const dem2di_contact_iterator *iterator, dem2d_histogram kind) {
    if (kind == DEM2D_HISTOGRAM_BRANCH)
        return dem2di_dot(iterator->branch, iterator->contact.normal);
    if (kind == DEM2D_HISTOGRAM_NORMAL_FORCE) return iterator->contact.force;
    return iterator->contact.shear;
}

static void dem2di_bin_contacts(const dem2d_world *world, dem2d_histogram kind, int bins,
                                int *counts, double *sums) {
    dem2di_contact_iterator iterator = dem2di_contacts_start(true);
    while (dem2di_next_contact(world, &iterator)) {
        dem2d_vec along =
            kind == DEM2D_HISTOGRAM_ALONG_BRANCH ? iterator.branch : iterator.contact.normal;
        const dem2d_vec ways[2] = {along, dem2di_negate(along)};
        for (int i = 0; i < 2; i++) {
            int bin = dem2di_bin(ways[i], 2 * DEM2DI_PI, bins);
            counts[bin]++;
            if (kind > DEM2D_HISTOGRAM_ALONG_BRANCH) sums[bin] += dem2di_binned(&iterator, kind);
        }
    }
}

DEM2D_API dem2d_result dem2d_world_histogram(const dem2d_world *world, dem2d_histogram kind,
                                             int bins, double *values) {
    if (world == NULL || values == NULL) return DEM2D_NULL_ARGUMENT;
    const dem2d_env *env = &world->env;
    dem2d_result result =
        dem2di_check_number(env, "kind", (int)kind, DEM2DI_CHOICE(DEM2D_HISTOGRAM_COUNT));
    if (result == DEM2D_OK)
        result = dem2di_check_number(env, "bins", bins, DEM2DI_WHOLE(1, DBL_MAX));
    if (result != DEM2D_OK) return result;
    size_t room = (size_t)bins, templates = (size_t)world->template_count + 1;
    int *counts = (int *)dem2di_allocate(env, room, sizeof *counts);
    dem2d_rot *axes = (dem2d_rot *)dem2di_allocate(env, templates, sizeof *axes);
    bool there = counts != NULL && axes != NULL;
    if (there) {
        memset(counts, 0, room * sizeof *counts);
        for (int i = 0; i < bins; i++) values[i] = 0;
        if (kind == DEM2D_HISTOGRAM_COORDINATION)
            dem2di_bin_coordination(world, bins, counts);
        else if (kind == DEM2D_HISTOGRAM_ORIENTATION)
            dem2di_bin_orientation(world, bins, axes, counts);
        else
            dem2di_bin_contacts(world, kind, bins, counts, values);
        for (int i = 0; i < bins; i++)
            values[i] = kind <= DEM2D_HISTOGRAM_ALONG_BRANCH ? counts[i]
                        : counts[i] > 0                      ? values[i] / counts[i]
                                                             : 0;
    }
    dem2di_release(env, axes, templates, sizeof *axes);
    dem2di_release(env, counts, room, sizeof *counts);
    return there ? DEM2D_OK : dem2di_out_of_memory(world, "a histogram");
}

/* --- distance from rest -------------------------------------------------------------------------
 */

/* Mean of the half steps before and after the last force pass. */
static dem2di_velocities dem2di_velocities_mean(const dem2d_world *world, int slot) {
    const dem2di_state *before = &world->before[slot];
    dem2di_velocities mean = dem2di_velocities_made(world, slot);
    mean.v = dem2di_scale(dem2di_add(before->v, mean.v), 0.5);
    mean.w = (before->w + mean.w) / 2;
    return mean;
}

/* Mean force of a contact, walls included; 0 without contacts. */
static double dem2di_mean_contact_force(const dem2d_world *world) {
    double sum = 0;
    int count = 0;
    dem2di_contact_iterator iterator = dem2di_contacts_start(false);
    for (; dem2di_next_contact(world, &iterator); count++)
        sum += dem2di_length(dem2di_contact_force(&iterator.contact));
    return count > 0 ? sum / count : 0;
}

static double dem2di_kinetic_ratio(const dem2d_world *world) {
    dem2d_energy energy;
    (void)dem2d_world_energy(world, &energy);
    double kinetic = energy.translational + energy.rotational;
    double springs = energy.normal + energy.tangential + energy.rolling;
    if (!(kinetic > 0)) return 0;
    return springs > 0 ? kinetic / springs : HUGE_VAL;
}

DEM2D_API dem2d_result dem2d_world_equilibrium(const dem2d_world *world,
                                               dem2d_equilibrium *equilibrium) {
    if (world == NULL || equilibrium == NULL) return DEM2D_NULL_ARGUMENT;
    double speeds = 0, most = 0, resultants = 0, force = dem2di_mean_contact_force(world);
    int moving = 0, unbound = 0;
    for (int place = 0, slot; (slot = dem2di_next_particle(world, &place)) >= 0;) {
        if (world->bodies[slot].motion == DEM2D_FIXED) continue;
        double speed = dem2di_length(dem2di_velocities_mean(world, slot).v);
        speeds += speed;
        most = dem2di_max(most, speed);
        moving++;
        if (world->bodies[slot].motion != DEM2D_FREE) continue;
        double mass = dem2di_body_mass(world, &world->bodies[slot]);
        dem2d_vec contacts = dem2di_load_of(world, slot).force;
        contacts = dem2di_add(contacts, dem2di_external(world, slot).force);
        resultants += dem2di_length(dem2di_along(contacts, mass, world->gravity));
        unbound++;
    }
    equilibrium->mean_speed = moving > 0 ? speeds / moving : 0;
    equilibrium->max_speed = most;
    equilibrium->kinetic_ratio = dem2di_kinetic_ratio(world);
    equilibrium->unbalanced = unbound > 0 && force > 0 ? resultants / unbound / force : 0;
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_inertial_number(const dem2d_world *world, double strain_rate,
                                                   double pressure, double *number) {
    if (world == NULL || number == NULL) return DEM2D_NULL_ARGUMENT;
    dem2d_result result =
        dem2di_check_number(&world->env, "strain_rate", strain_rate, DEM2DI_FINITE);
    if (result == DEM2D_OK)
        result = dem2di_check_number(&world->env, "pressure", pressure, DEM2DI_POSITIVE);
    if (result != DEM2D_OK) return result;
    double diameters = 0, mass = 0, area = 0;
    int count = 0;
    for (int place = 0, slot; (slot = dem2di_next_particle(world, &place)) >= 0; count++) {
        diameters += 2 * dem2di_equivalent(world, slot);
        mass += dem2di_body_mass(world, &world->bodies[slot]);
        area += dem2di_body_area(world, &world->bodies[slot]);
    }
    *number = 0;
    if (count > 0) *number = fabs(strain_rate) * (diameters / count) * sqrt(mass / area / pressure);
    return DEM2D_OK;
}

/* ============================================================================================
   >>queries  What is where: overlaps, rays, the nearest; contacts of one particle
   uses: config, math, memory, fields, support, shapes, gjk, contact, broad, law, motion, world,
         objects, walls, measures
   ============================================================================================ */

/* The search tree is in world->tree. Its items are the particles and the segments of walls: slots
   of particles, or -1 - k for part k of the walls. They are sorted along the Z-order curve and cut
   into leaves of equal numbers; above them is a complete binary tree of boxes, with the children of
   node k at 2k + 1 and 2k + 2. It is made when a query needs it, and no longer valid once something
   has moved (tree.made). A tree has no cells, so that rays through empty space, sizes of any
   mixture and distant scenes cost no more.

   A question visits the nodes that are within its limit, the nearer child first, and looks at each
   item of a leaf; then at each half-plane. */

/* Of a ray: distance of tangent and chord at a right angle to the surface, of the radius. A hundred
   times the rounding errors of support points. */
#define DEM2DI_RAY 1e-12

#define DEM2DI_LEAF 8        /* items in a leaf at most: the minimum is flat */
#define DEM2DI_TREE_DEPTH 64 /* more than levels of a tree of 2^31 items */

/* Lists of up to this many are sorted by insertion: a radix sort counts 256 digits for a byte. */
#define DEM2DI_FEW_FOUND 32

typedef enum dem2di_ask { DEM2DI_ASK_REGION, DEM2DI_ASK_RAY, DEM2DI_ASK_NEAREST } dem2di_ask;

typedef struct dem2di_question {
    dem2d_world *world;
    dem2di_ask ask;
    dem2d_query_desc desc;
    dem2d_box box;            /* of the region */
    const dem2d_shape *shape; /* the region; NULL when it is the box */
    dem2d_pose pose;          /* of the shape */
    dem2d_vec origin;         /* of the ray; the point */
    dem2d_vec direction;      /* of the ray, unit, */
    dem2d_vec inverse;        /* and 1 over its components */
    double limit;             /* what is farther does not matter; beyond 0 for a region */
    bool all;                 /* items go into tree.found, else only the nearest is kept */
    int count;                /* of tree.found */
    int item;                 /* the nearest, */
    dem2d_hit hit;            /* if there is one */
} dem2di_question;

/* --- the tree ----------------------------------------------------------------------------------
 */

static dem2d_box dem2di_box_join(const dem2d_box *a, const dem2d_box *b) {
    dem2d_box box;
    box.lower.x = dem2di_min(a->lower.x, b->lower.x);
    box.lower.y = dem2di_min(a->lower.y, b->lower.y);
    box.upper.x = dem2di_max(a->upper.x, b->upper.x);
    box.upper.y = dem2di_max(a->upper.y, b->upper.y);
    return box;
}

/* The bounding circle of a particle in a box, and a margin for rounding errors. */
static dem2d_box dem2di_bounding_box(const dem2di_state *state) {
    double margin = DEM2DI_ROUNDOFF * (dem2di_size_of(state->x) + state->radius);
    double reach = state->radius + margin;
    dem2d_box box;
    box.lower = dem2di_sub(state->x, dem2di_vec(reach, reach));
    box.upper = dem2di_add(state->x, dem2di_vec(reach, reach));
    return box;
}

/* The box of an item: of a segment both ends, with such a margin. */
static dem2d_box dem2di_item_box(const dem2d_world *world, int item) {
    if (item >= 0) return dem2di_bounding_box(&world->now[item]);
    const dem2di_surface *surface = &world->surfaces[-1 - item];
    dem2d_vec end = dem2di_surface_end(surface, world->parts[-1 - item].extent);
    double size = dem2di_size_of(surface->point) + dem2di_size_of(end);
    dem2d_vec margin = dem2di_vec(DEM2DI_ROUNDOFF * size, DEM2DI_ROUNDOFF * size);
    dem2d_box from = {surface->point, surface->point}, to = {end, end};
    dem2d_box box = dem2di_box_join(&from, &to);
    box.lower = dem2di_sub(box.lower, margin);
    box.upper = dem2di_add(box.upper, margin);
    return box;
}

static dem2d_vec dem2di_box_centre(const dem2d_box *box) {
    return dem2di_along(box->lower, 0.5, dem2di_sub(box->upper, box->lower));
}

/* The items, sorted along the curve. */
static void dem2di_tree_sort(dem2d_world *world) {
    dem2di_tree *tree = &world->tree;
    dem2d_box all = {{0, 0}, {0, 0}};
    int count = 0;
    for (int i = 0; i < world->body_count; i++)
        if (world->bodies[i].shape_index >= 0) tree->found[count++].value = i;
    for (int k = 0; k < world->part_count; k++)
        if (world->parts[k].extent > 0) tree->found[count++].value = -1 - k;
    for (int i = 0; i < count; i++) {
        dem2d_box box = dem2di_item_box(world, tree->found[i].value);
        all = i == 0 ? box : dem2di_box_join(&all, &box);
    }
    double size = dem2di_max(all.upper.x - all.lower.x, all.upper.y - all.lower.y);
    for (int i = 0; i < count; i++) {
        dem2d_box box = dem2di_item_box(world, tree->found[i].value);
        tree->found[i].key = dem2di_curve_place(all.lower, size, dem2di_box_centre(&box));
    }
    dem2di_sort(tree->found, tree->spare, count);
    for (int i = 0; i < count; i++) tree->items[i] = tree->found[i].value;
    tree->count = count;
}

/* Where the items of leaf k begin. */
static int dem2di_leaf_begin(const dem2di_tree *tree, int k) {
    return (int)((int64_t)tree->count * k >> tree->levels);
}

/* Room for what a query may find, and a tree. */
static dem2d_result dem2di_tree_make(dem2d_world *world) {
    dem2di_tree *tree = &world->tree;
    int levels = 0, items = world->body_count + world->part_count;
    while (DEM2DI_LEAF << levels < items) levels++;
    int leaves = 1 << levels, nodes = 2 * leaves - 1;
    if (!dem2di_group_reserve(world, DEM2DI_TREE, items > nodes ? items : nodes))
        return dem2di_out_of_memory(world, "a search tree");
    if (tree->made) return DEM2D_OK;
    tree->levels = levels;
    tree->leaves = leaves;
    dem2di_tree_sort(world);
    for (int k = 0; k < leaves; k++) {
        const dem2d_box none = {{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}};
        dem2d_box *box = &tree->boxes[leaves - 1 + k];
        *box = none;
        for (int i = dem2di_leaf_begin(tree, k); i < dem2di_leaf_begin(tree, k + 1); i++) {
            dem2d_box own = dem2di_item_box(world, tree->items[i]);
            *box = dem2di_box_join(box, &own);
        }
    }
    for (int k = leaves - 2; k >= 0; k--)
        tree->boxes[k] = dem2di_box_join(&tree->boxes[2 * k + 1], &tree->boxes[2 * k + 2]);
    tree->made = true;
    return DEM2D_OK;
}

/* --- how far things are ------------------------------------------------------------------------
 */

/* 1 over a direction's component; of 0 the greatest number, by which 0 stays 0. */
static double dem2di_inverse_component(double component) {
    return fabs(component) > 1 / DBL_MAX ? 1 / component : DBL_MAX;
}

/* Where a ray is within a box: from in[0] to in[1], >= 0; in[0] > in[1] when it is not. `inverse`
   has 1 over the components of the unit direction. */
static inline void dem2di_ray_box(dem2d_vec origin, dem2d_vec inverse, const dem2d_box *box,
                                  double in[2]) {
    double x0 = (box->lower.x - origin.x) * inverse.x, x1 = (box->upper.x - origin.x) * inverse.x;
    double y0 = (box->lower.y - origin.y) * inverse.y, y1 = (box->upper.y - origin.y) * inverse.y;
    in[0] = dem2di_max(0, dem2di_max(dem2di_min(x0, x1), dem2di_min(y0, y1)));
    in[1] = dem2di_min(dem2di_max(x0, x1), dem2di_max(y0, y1));
}

/* From a point to the nearest point of a box; 0 inside. */
static inline dem2d_vec dem2di_to_box(dem2d_vec point, const dem2d_box *box) {
    double x = dem2di_max(box->lower.x, dem2di_min(point.x, box->upper.x));
    double y = dem2di_max(box->lower.y, dem2di_min(point.y, box->upper.y));
    return dem2di_vec(x - point.x, y - point.y);
}

/* How far what is in a box is at least; HUGE_VAL: it does not matter. */
static double dem2di_reach(const dem2di_question *question, const dem2d_box *box) {
    const dem2d_box *own = &question->box;
    double in[2];
    switch (question->ask) {
    case DEM2DI_ASK_RAY:
        dem2di_ray_box(question->origin, question->inverse, box, in);
        return in[0] <= in[1] ? in[0] : HUGE_VAL;
    case DEM2DI_ASK_NEAREST:
        return dem2di_length(dem2di_to_box(question->origin, box));
    case DEM2DI_ASK_REGION:
        break;
    }
    return own->lower.x <= box->upper.x && own->upper.x >= box->lower.x &&
                   own->lower.y <= box->upper.y && own->upper.y >= box->lower.y
               ? 0
               : HUGE_VAL;
}

/* --- regions -----------------------------------------------------------------------------------
 */

/* Do two shapes overlap, or touch within rounding errors? */
static bool dem2di_overlap(dem2di_pair *pair) {
    dem2di_search search;
    dem2di_gjk(pair, dem2di_centres(pair), 0, 128, true, &search);
    return search.state != DEM2D_SEPARATED;
}

/* A rectangle about its centre, to overlap with: its corners are where it is told. */
static void dem2di_rectangle_set(double width, double height, dem2d_shape *shape,
                                 dem2d_vec corners[4]) {
    memset((void *)shape, 0, sizeof *shape);
    shape->type = DEM2D_POLYGON;
    shape->count = shape->parts = 4; /* so few need no tangents and no table */
    shape->corners = corners;
    for (int k = 0; k < 4; k++)
        corners[k] = dem2di_vec(k == 1 || k == 2 ? width / 2 : -width / 2,
                                k >= 2 ? height / 2 : -height / 2);
    shape->circumscribed = dem2di_length(corners[2]);
}

/* Does a particle overlap the box? Only what is near the particle counts, so that a box may be of
   any size. */
static bool dem2di_box_overlaps(const dem2di_question *question, int slot) {
    const dem2d_world *world = question->world;
    const dem2di_state *state = &world->now[slot];
    const dem2d_box *own = &question->box, round = dem2di_bounding_box(state);
    dem2d_vec from = dem2di_to_box(state->x, own);
    if (dem2di_dot(from, from) > state->radius * state->radius) return false;
    if (dem2di_is_circle(world, slot) || (from.x == 0 && from.y == 0)) return true;
    dem2d_vec lower = dem2di_vec(dem2di_max(own->lower.x, round.lower.x),
                                 dem2di_max(own->lower.y, round.lower.y));
    dem2d_vec upper = dem2di_vec(dem2di_min(own->upper.x, round.upper.x),
                                 dem2di_min(own->upper.y, round.upper.y));
    dem2d_shape rectangle;
    dem2d_vec corners[4];
    dem2di_rectangle_set(upper.x - lower.x, upper.y - lower.y, &rectangle, corners);
    dem2d_pose pose = dem2di_pose_of(world, world->now, slot), there = pose;
    there.position = dem2di_along(lower, 0.5, dem2di_sub(upper, lower));
    there.rotation.c = there.scale = 1;
    there.rotation.s = 0;
    dem2di_pair pair =
        dem2di_pair_make(dem2di_shape_of(world, &world->bodies[slot]), &pose, &rectangle, &there);
    return dem2di_overlap(&pair);
}

static bool dem2di_region_has(const dem2di_question *question, int slot) {
    const dem2d_world *world = question->world;
    const dem2di_state *state = &world->now[slot];
    const dem2d_shape *shape = question->shape;
    if (shape == NULL) return dem2di_box_overlaps(question, slot);
    dem2d_vec d = dem2di_centre_line(question->pose.position, state->x);
    double reach = shape->circumscribed * question->pose.scale + state->radius;
    if (dem2di_dot(d, d) > reach * reach) return false;
    if (shape->type == DEM2D_CIRCLE && dem2di_is_circle(world, slot)) return true;
    dem2d_pose pose = dem2di_pose_of(world, world->now, slot);
    dem2di_pair pair = dem2di_pair_make(shape, &question->pose,
                                        dem2di_shape_of(world, &world->bodies[slot]), &pose);
    return dem2di_overlap(&pair);
}

/* Point of the region farthest along a direction. */
static dem2d_vec dem2di_region_support(const dem2di_question *question, dem2d_vec u) {
    const dem2d_box *box = &question->box;
    const dem2d_pose *pose = &question->pose;
    if (question->shape == NULL)
        return dem2di_vec(u.x > 0 ? box->upper.x : box->lower.x,
                          u.y > 0 ? box->upper.y : box->lower.y);
    dem2d_vec own = dem2di_support(question->shape, dem2di_turn_back(pose->rotation, u), NULL);
    return dem2di_add(pose->position, dem2di_at_pose(pose, own));
}

/* Of a segment only what is near the shape counts, as for contacts. */
static bool dem2di_region_has_segment(const dem2di_question *question, int part) {
    const dem2d_world *world = question->world;
    const dem2di_surface *surface = &world->surfaces[part];
    const dem2d_pose *pose = &question->pose;
    dem2d_vec along = dem2di_vec(surface->along.c, surface->along.s);
    double in[2], extent = world->parts[part].extent;
    if (question->shape == NULL) {
        dem2d_vec inverse =
            dem2di_vec(dem2di_inverse_component(along.x), dem2di_inverse_component(along.y));
        dem2di_ray_box(surface->point, inverse, &question->box, in);
        return in[0] <= in[1] && in[0] <= extent;
    }
    double radius = question->shape->circumscribed * pose->scale;
    if (!(dem2di_part_distance(world, part, pose->position) <= radius)) return false;
    double foot = dem2di_dot(dem2di_sub(pose->position, surface->point), along);
    double from = dem2di_max(0, foot - 2 * radius), to = dem2di_min(extent, foot + 2 * radius);
    dem2d_pose line;
    line.position = dem2di_along(surface->point, from + (to - from) / 2, along);
    line.rotation = surface->along;
    line.scale = to - from;
    dem2di_pair pair = dem2di_pair_make(question->shape, pose, world->line, &line);
    return dem2di_overlap(&pair);
}

static bool dem2di_region_has_part(const dem2di_question *question, int part) {
    if (question->world->parts[part].extent > 0) return dem2di_region_has_segment(question, part);
    const dem2di_surface *surface = &question->world->surfaces[part];
    dem2d_vec normal = dem2di_surface_normal(surface);
    dem2d_vec deepest = dem2di_region_support(question, dem2di_negate(normal));
    dem2d_vec from = dem2di_sub(deepest, surface->point);
    return dem2di_dot(from, normal) <= DEM2DI_ROUNDOFF * dem2di_size_of(from);
}

/* --- rays --------------------------------------------------------------------------------------
   A line through p (near the template, at scale 1) along a unit direction d enters a convex shape
   at p + at d, at < 0 allowed, where its normal is n. */
typedef struct dem2di_entry {
    double at;
    dem2d_vec normal;
} dem2di_entry;

/* (p + at d)^2/(a, b) = 1, with the half axes' squares a and b. The discriminant without the
   difference of two large numbers: 1/a d.x^2 + 1/b d.y^2 - (p x d)^2/(a b). */
static bool dem2di_ellipse_entry(double a, double b, dem2d_vec p, dem2d_vec d,
                                 dem2di_entry *entry) {
    double square = d.x * d.x / a + d.y * d.y / b, middle = p.x * d.x / a + p.y * d.y / b;
    double arm = dem2di_cross(p, d), left = square - arm * arm / a / b;
    if (left < 0) return false;
    entry->at = -(middle + sqrt(left)) / square;
    dem2d_vec point = dem2di_along(p, entry->at, d);
    return dem2di_unit(dem2di_vec(point.x / a, point.y / b), &entry->normal);
}

/* A polygon is entered at the last of the edges that face the line, unless it was left before. The
   edges of a rounded one are moved outwards; where the line passes the end of such an edge, it can
   only meet the circle of the corner there. */
static bool dem2di_polygon_entry(const dem2d_shape *shape, dem2d_vec p, dem2d_vec d,
                                 dem2di_entry *entry) {
    double out = HUGE_VAL, rounding = shape->rounding;
    int edge = -1;
    for (int k = 0; k < shape->count; k++) {
        dem2d_vec normal = dem2di_right(shape->tangents[k]);
        double height = dem2di_dot(normal, dem2di_sub(shape->corners[k], p)) + rounding;
        double speed = dem2di_dot(normal, d), at = height / speed;
        if (speed == 0 && height < 0) return false;
        if (speed > 0 && at < out) out = at;
        if (speed >= 0 || (edge >= 0 && at <= entry->at)) continue;
        edge = k;
        entry->at = at;
        entry->normal = normal;
    }
    if (edge < 0 || entry->at > out + DEM2DI_ROUNDOFF * shape->circumscribed) return false;
    if (rounding == 0) return true;
    int next = dem2di_around(shape->count, edge, 1);
    dem2d_vec corner = shape->corners[edge], end = shape->corners[next];
    dem2d_vec tangent = shape->tangents[edge], point = dem2di_along(p, entry->at, d);
    double place = dem2di_dot(dem2di_sub(point, corner), tangent);
    if (place >= 0 && place <= dem2di_dot(dem2di_sub(end, corner), tangent)) return true;
    double square = rounding * rounding;
    return dem2di_ellipse_entry(square, square, dem2di_sub(p, place < 0 ? corner : end), d, entry);
}

/* Two support points of a shape, relative to p, the first to the left of the line and the second to
   its right. The entry is between their normals. */
typedef struct dem2di_straddle {
    dem2d_vec u[2], s[2];
    double side[2]; /* distance from the line, >= 0 and <= 0 */
} dem2di_straddle;

/* The support point of a normal comes in, in the place of the one on its side. */
static void dem2di_straddle_put(dem2di_straddle *both, int end, dem2d_vec d, dem2d_vec u,
                                dem2d_vec s) {
    both->u[end] = u;
    both->s[end] = s;
    both->side[end] = dem2di_cross(d, s);
}

/* The next normal: a step of Newton's, of which the next support point is on the line to first
   order (its distance changes by rho u.d for each radian), or every third time, and where that
   leaves the bracket, the normal of the chord. */
static dem2d_vec dem2di_straddle_next(const dem2di_straddle *both, dem2d_vec u, double turn,
                                      bool chord) {
    dem2d_vec next, middle;
    if (!chord && fabs(turn) < 1 && dem2di_unit(dem2di_along(u, turn, dem2di_perp(u)), &next) &&
        dem2di_cross(both->u[0], next) > 0 && dem2di_cross(next, both->u[1]) > 0)
        return next;
    if (dem2di_unit(dem2di_right(dem2di_sub(both->s[1], both->s[0])), &next)) return next;
    middle = dem2di_add(both->u[0], both->u[1]);
    return dem2di_unit(middle, &next) ? next : u;
}

/* Any support function h. The tangent with the normal u is crossed at (h(u) - u.p)/(u.d), if u
   faces the line (u.d < 0); the entry is the greatest of these. Its support point is on the line:
   the points to both sides, whose distance from the line is monotone in the angle of u, are brought
   together. The entry lies between the greatest crossing of a tangent and that of the chord. */
static bool dem2di_support_entry(const dem2d_shape *shape, dem2d_vec p, dem2d_vec d,
                                 dem2di_entry *entry) {
    dem2di_straddle both;
    double square = shape->circumscribed * shape->circumscribed - dem2di_dot(p, p);
    dem2d_vec u = dem2di_negate(d), across = dem2di_perp(d);
    if (square > 0) (void)dem2di_unit(dem2di_along(p, -sqrt(square), d), &u); /* of the circle */
    for (int end = 0; end < 2; end++, across = dem2di_negate(across))
        dem2di_straddle_put(&both, end, d, across,
                            dem2di_sub(dem2di_support(shape, across, NULL), p));
    if (both.side[0] < 0 || both.side[1] > 0) return false;
    entry->at = -HUGE_VAL;
    for (int i = 0; i < 128; i++) {
        double rho, facing = dem2di_dot(u, d);
        dem2d_vec s = dem2di_sub(dem2di_support(shape, u, &rho), p);
        double side = dem2di_cross(d, s), at = dem2di_dot(s, u) / facing;
        dem2di_straddle_put(&both, side < 0, d, u, s);
        if (at > entry->at) {
            entry->at = at;
            entry->normal = u;
        }
        double width = both.side[0] - both.side[1], share = width > 0 ? both.side[0] / width : 0;
        double from = dem2di_dot(both.s[0], d), to = dem2di_dot(both.s[1], d);
        double inside = from + share * (to - from);
        if ((inside - entry->at) * -facing <= DEM2DI_RAY * shape->circumscribed) break;
        u = dem2di_straddle_next(&both, u, -side / (rho * facing), i % 3 == 2);
    }
    return true;
}

/* Where a line enters a template. */
static bool dem2di_entry_find(const dem2d_shape *shape, dem2d_vec p, dem2d_vec d,
                              dem2di_entry *entry) {
    switch (shape->type) {
    case DEM2D_CIRCLE:
        return dem2di_ellipse_entry(shape->a * shape->a, shape->a * shape->a, p, d, entry);
    case DEM2D_ELLIPSE:
        return dem2di_ellipse_entry(shape->a, shape->b, p, d, entry);
    case DEM2D_POLYGON:
        return dem2di_polygon_entry(shape, p, d, entry);
    case DEM2D_BEZIER:
    case DEM2D_FOURIER:
    case DEM2D_CUSTOM:
    case DEM2D_SHAPE_TYPE_COUNT:
        break;
    }
    return dem2di_support_entry(shape, p, d, entry);
}

/* A hit of a ray, with the distance along it; an origin inside is a hit at 0. */
static bool dem2di_hit_set(const dem2di_question *question, double distance, dem2d_vec normal,
                           bool inside, dem2d_hit *hit) {
    hit->distance = inside ? 0 : distance;
    hit->normal = inside ? dem2di_negate(question->direction) : normal;
    hit->point = dem2di_along(question->origin, hit->distance, question->direction);
    return hit->distance >= 0 && hit->distance <= question->limit;
}

/* The line is looked at from its point nearest to the centre on, so that distant origins cost no
   digits. Where it is entered behind the origin, it may be left before or behind: against the
   ray that is an entry, too. */
static bool dem2di_ray_particle(const dem2di_question *question, int slot, dem2d_hit *hit) {
    const dem2d_world *world = question->world;
    const dem2di_state *state = &world->now[slot];
    const dem2d_shape *shape = dem2di_shape_of(world, &world->bodies[slot]);
    dem2d_vec d = question->direction, from = dem2di_sub(question->origin, state->x);
    double foot = -dem2di_dot(from, d), arm = dem2di_cross(d, from), radius = state->radius;
    if (fabs(arm) > radius || foot + radius < 0 || foot - radius > question->limit) return false;
    dem2d_pose pose;
    memset(&pose, 0, sizeof pose);
    pose.rotation.c = 1;
    pose.scale = world->bodies[slot].scale;
    if (shape->type != DEM2D_CIRCLE) pose = dem2di_pose_of(world, world->now, slot);
    dem2d_vec own = dem2di_turn_back(pose.rotation, d);
    dem2d_vec p = dem2di_scale(dem2di_perp(own), arm / pose.scale);
    dem2di_entry entry, leave;
    if (!dem2di_entry_find(shape, p, own, &entry)) return false;
    double distance = foot + pose.scale * entry.at;
    bool inside = distance <= 0 && dem2di_entry_find(shape, p, dem2di_negate(own), &leave) &&
                  foot - pose.scale * leave.at >= 0;
    return dem2di_hit_set(question, distance, dem2di_turn(pose.rotation, entry.normal), inside,
                          hit);
}

/* A segment is met where the ray crosses its line, from both sides, within rounding errors of its
   ends, so that no ray passes a joint; one along it meets the nearer end. */
static bool dem2di_ray_segment(const dem2di_question *question, int part, dem2d_hit *hit) {
    const dem2di_surface *surface = &question->world->surfaces[part];
    double extent = question->world->parts[part].extent;
    dem2d_vec d = question->direction, along = dem2di_vec(surface->along.c, surface->along.s);
    dem2d_vec to = dem2di_sub(surface->point, question->origin);
    double sine = dem2di_cross(d, along), margin = DEM2DI_ROUNDOFF * (extent + dem2di_size_of(to));
    if (fabs(sine) <= DEM2DI_ROUNDOFF) {
        double start = dem2di_dot(to, d), end = start + extent * dem2di_dot(along, d);
        double first = dem2di_min(start, end), last = dem2di_max(start, end);
        if (fabs(dem2di_cross(d, to)) > margin) return false;
        return dem2di_hit_set(question, first, dem2di_negate(d), first <= 0 && last >= 0, hit);
    }
    double place = dem2di_cross(to, d) / sine, distance = dem2di_cross(to, along) / sine;
    if (place * fabs(sine) < -margin || (place - extent) * fabs(sine) > margin) return false;
    dem2d_vec normal = sine > 0 ? dem2di_perp(along) : dem2di_right(along);
    return dem2di_hit_set(question, distance, normal, false, hit);
}

static bool dem2di_ray_part(const dem2di_question *question, int part, dem2d_hit *hit) {
    if (question->world->parts[part].extent > 0) return dem2di_ray_segment(question, part, hit);
    dem2d_vec normal = dem2di_surface_normal(&question->world->surfaces[part]);
    double height = dem2di_part_distance(question->world, part, question->origin);
    double speed = dem2di_dot(question->direction, normal);
    if (height > 0 && !(speed < 0)) return false;
    return dem2di_hit_set(question, -height / speed, normal, height <= 0, hit);
}

/* --- the nearest -------------------------------------------------------------------------------
 */

/* A surface that has its nearest point at a distance from the point, against the normal. */
static void dem2di_nearest_set(const dem2di_question *question, double distance, dem2d_vec normal,
                               dem2d_hit *hit) {
    hit->distance = distance > 0 ? distance : 0;
    hit->normal = distance > 0 ? normal : dem2di_vec(0, 0);
    hit->point = dem2di_along(question->origin, -hit->distance, normal);
}

static bool dem2di_nearest_particle(const dem2di_question *question, int slot, dem2d_hit *hit) {
    const dem2d_world *world = question->world;
    const dem2di_state *state = &world->now[slot];
    dem2d_vec from = dem2di_sub(question->origin, state->x), normal = dem2di_vec(0, 0);
    double distance = dem2di_length(from);
    if (distance - state->radius > question->limit) return false;
    if (dem2di_is_circle(world, slot)) {
        (void)dem2di_unit(from, &normal);
        dem2di_nearest_set(question, distance - state->radius, normal, hit);
        return hit->distance <= question->limit;
    }
    dem2d_shape dot; /* a circle of radius 0 */
    dem2d_contact_desc desc;
    dem2d_contact contact;
    memset((void *)&dot, 0, sizeof dot);
    memset(&desc, 0, sizeof desc);
    desc.skip_points = true;
    dem2d_pose pose = dem2di_pose_of(world, world->now, slot), there = pose;
    there.position = question->origin;
    if (dem2d_pair_contact(dem2di_shape_of(world, &world->bodies[slot]), pose, &dot, there, &desc,
                           &contact) != DEM2D_OK)
        return false; /* farther than numbers have squares */
    dem2di_nearest_set(question, -contact.depth, contact.normal, hit);
    return hit->distance <= question->limit;
}

static bool dem2di_nearest_part(const dem2di_question *question, int part, dem2d_hit *hit) {
    const dem2di_surface *surface = &question->world->surfaces[part];
    double distance = dem2di_part_distance(question->world, part, question->origin);
    double extent = question->world->parts[part].extent;
    dem2d_vec normal = dem2di_surface_normal(surface);
    if (extent > 0) {
        dem2d_vec along = dem2di_vec(surface->along.c, surface->along.s);
        dem2d_vec from = dem2di_sub(question->origin, surface->point);
        double place = dem2di_max(0, dem2di_min(extent, dem2di_dot(from, along)));
        (void)dem2di_unit(dem2di_along(from, -place, along), &normal);
    }
    dem2di_nearest_set(question, distance, normal, hit);
    return hit->distance <= question->limit;
}

/* --- asking ------------------------------------------------------------------------------------
 */

/* Does a question find an item? Of rays and the nearest, where. */
static bool dem2di_item_find(const dem2di_question *question, int item, dem2d_hit *hit) {
    int part = -1 - item;
    if (item >= 0 ? question->desc.skip_particles : question->desc.skip_walls) return false;
    switch (question->ask) {
    case DEM2DI_ASK_RAY:
        return item >= 0 ? dem2di_ray_particle(question, item, hit)
                         : dem2di_ray_part(question, part, hit);
    case DEM2DI_ASK_NEAREST:
        return item >= 0 ? dem2di_nearest_particle(question, item, hit)
                         : dem2di_nearest_part(question, part, hit);
    case DEM2DI_ASK_REGION:
        break;
    }
    return item >= 0 ? dem2di_region_has(question, item) : dem2di_region_has_part(question, part);
}

/* The order of results: particles, then walls, each by index, then parts by number. */
static uint64_t dem2di_item_rank(const dem2d_world *world, int item) {
    if (item >= 0) return (uint64_t)world->bodies[item].index;
    int wall = world->parts[-1 - item].wall;
    return (uint64_t)(wall + 1) << 32 | (uint64_t)(-1 - item - world->walls[wall].first);
}

/* One item is looked at: it goes to the others, or is kept if it is the nearest so far. */
static void dem2di_item_ask(dem2di_question *question, int item) {
    dem2d_world *world = question->world;
    dem2d_hit hit;
    memset(&hit, 0, sizeof hit);
    if (!dem2di_item_find(question, item, &hit)) return;
    if (question->all) {
        dem2di_order *found = &world->tree.found[question->count++];
        found->key = dem2di_item_rank(world, item);
        found->value = item;
        return;
    }
    bool later = question->count > 0 && hit.distance == question->limit &&
                 dem2di_item_rank(world, item) > dem2di_item_rank(world, question->item);
    if (later) return;
    question->count = 1;
    question->item = item;
    question->hit = hit;
    question->limit = hit.distance;
}

/* Nodes within the limit, the nearer child first. */
static void dem2di_tree_ask(dem2di_question *question) {
    const dem2di_tree *tree = &question->world->tree;
    struct {
        int node;
        double reach;
    } stack[DEM2DI_TREE_DEPTH];
    int depth = 0;
    stack[depth].node = 0;
    stack[depth++].reach = dem2di_reach(question, &tree->boxes[0]);
    while (depth-- > 0) {
        int node = stack[depth].node, leaf = node - (tree->leaves - 1);
        if (stack[depth].reach > question->limit) continue;
        if (leaf >= 0) {
            for (int i = dem2di_leaf_begin(tree, leaf); i < dem2di_leaf_begin(tree, leaf + 1); i++)
                dem2di_item_ask(question, tree->items[i]);
            continue;
        }
        double reach[2];
        for (int k = 0; k < 2; k++)
            reach[k] = dem2di_reach(question, &tree->boxes[2 * node + 1 + k]);
        for (int k = 0; k < 2; k++) { /* the last one is taken first */
            int child = (reach[0] < reach[1]) == (k == 0);
            if (reach[child] > question->limit) continue;
            stack[depth].node = 2 * node + 1 + child;
            stack[depth++].reach = reach[child];
        }
    }
}

static dem2d_result dem2di_question_ask(dem2di_question *question) {
    dem2d_world *world = question->world;
    dem2d_result result = dem2di_tree_make(world);
    if (result != DEM2D_OK) return result;
    if (world->tree.count > 0) dem2di_tree_ask(question);
    for (int j = 0; j < world->wall_count; j++) {
        const dem2di_wall *wall = &world->walls[j];
        if (wall->count > 0 && !(world->parts[wall->first].extent > 0))
            dem2di_item_ask(question, -1 - wall->first);
    }
    return DEM2D_OK;
}

static dem2di_question dem2di_question_make(dem2d_world *world, dem2di_ask ask,
                                            const dem2d_query_desc *desc) {
    dem2di_question question;
    memset(&question, 0, sizeof question);
    question.world = world;
    question.ask = ask;
    if (desc != NULL) question.desc = *desc;
    question.limit = DBL_MAX; /* below HUGE_VAL, which is out of reach */
    return question;
}

static dem2d_found dem2di_found_of(const dem2d_world *world, int item) {
    dem2d_found found;
    memset(&found, 0, sizeof found);
    if (item >= 0) {
        found.particle = dem2di_particle_id(world, item);
        return found;
    }
    int wall = world->parts[-1 - item].wall;
    found.wall = dem2di_wall_id(world, wall);
    found.part = -1 - item - world->walls[wall].first;
    return found;
}

/* By their keys; equal ones keep their order. */
static void dem2di_found_sort(const dem2di_tree *tree, int count) {
    if (count > DEM2DI_FEW_FOUND) {
        dem2di_sort(tree->found, tree->spare, count);
        return;
    }
    for (int i = 1; i < count; i++) {
        dem2di_order own = tree->found[i];
        int k = i;
        for (; k > 0 && tree->found[k - 1].key > own.key; k--) tree->found[k] = tree->found[k - 1];
        tree->found[k] = own;
    }
}

/* Room for results is there, unless none is asked for. */
static dem2d_result dem2di_check_room(const dem2d_world *world, const char *name, const void *room,
                                      int capacity) {
    if (room == NULL && capacity > 0) return dem2di_fail_null(&world->env, name);
    return dem2di_check_number(&world->env, "capacity", capacity, DEM2DI_COUNT);
}

/* All that overlaps a region. */
static dem2d_result dem2di_region_ask(dem2di_question *question, dem2d_found *found, int capacity,
                                      int *count) {
    dem2d_world *world = question->world;
    question->all = true;
    dem2d_result result = dem2di_check_room(world, "found", found, capacity);
    if (result == DEM2D_OK) result = dem2di_question_ask(question);
    if (result != DEM2D_OK) return result;
    dem2di_found_sort(&world->tree, question->count);
    for (int i = 0; i < question->count && i < capacity; i++)
        found[i] = dem2di_found_of(world, world->tree.found[i].value);
    *count = question->count;
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_query_box(dem2d_world *world, const dem2d_box *box,
                                             const dem2d_query_desc *desc, dem2d_found *found,
                                             int capacity, int *count) {
    if (world == NULL || count == NULL) return DEM2D_NULL_ARGUMENT;
    if (box == NULL) return dem2di_fail_null(&world->env, "box");
    dem2di_question question = dem2di_question_make(world, DEM2DI_ASK_REGION, desc);
    dem2d_result result = dem2di_check_vec(&world->env, "box.lower", box->lower);
    if (result == DEM2D_OK) result = dem2di_check_vec(&world->env, "box.upper", box->upper);
    if (result != DEM2D_OK) return result;
    if (!(box->upper.x >= box->lower.x && box->upper.y >= box->lower.y))
        return dem2di_fail(&world->env, DEM2D_OUT_OF_RANGE, -1, "box.upper is below box.lower");
    question.box = *box;
    return dem2di_region_ask(&question, found, capacity, count);
}

DEM2D_API dem2d_result dem2d_world_query_point(dem2d_world *world, dem2d_vec point,
                                               const dem2d_query_desc *desc, dem2d_found *found,
                                               int capacity, int *count) {
    if (world == NULL || count == NULL) return DEM2D_NULL_ARGUMENT;
    dem2di_question question = dem2di_question_make(world, DEM2DI_ASK_REGION, desc);
    dem2d_result result = dem2di_check_vec(&world->env, "point", point);
    if (result != DEM2D_OK) return result;
    question.box.lower = question.box.upper = point;
    return dem2di_region_ask(&question, found, capacity, count);
}

DEM2D_API dem2d_result dem2d_world_query_shape(dem2d_world *world, const dem2d_shape *shape,
                                               dem2d_pose pose, const dem2d_query_desc *desc,
                                               dem2d_found *found, int capacity, int *count) {
    if (world == NULL || count == NULL) return DEM2D_NULL_ARGUMENT;
    if (shape == NULL) return dem2di_fail_null(&world->env, "shape");
    dem2di_question question = dem2di_question_make(world, DEM2DI_ASK_REGION, desc);
    dem2d_result result = dem2di_check_pose(&pose);
    if (result != DEM2D_OK) return dem2di_fail(&world->env, result, -1, "pose is not valid");
    double radius = shape->circumscribed * pose.scale, square = radius * radius;
    if (!(dem2di_finite(square) && square * DEM2DI_ROUNDOFF * DEM2DI_ROUNDOFF > DBL_MIN))
        return dem2di_fail(&world->env, DEM2D_OUT_OF_RANGE, -1, "pose: scale = %g", pose.scale);
    question.shape = shape;
    question.pose = pose;
    question.box.lower = dem2di_sub(pose.position, dem2di_vec(radius, radius));
    question.box.upper = dem2di_add(pose.position, dem2di_vec(radius, radius));
    return dem2di_region_ask(&question, found, capacity, count);
}

/* The ray of a question is checked and put into it. */
static dem2d_result dem2di_ray_set(dem2di_question *question, dem2d_vec origin, dem2d_vec direction,
                                   double length) {
    const dem2d_env *env = &question->world->env;
    dem2d_result result = dem2di_check_vec(env, "origin", origin);
    if (result == DEM2D_OK) result = dem2di_check_vec(env, "direction", direction);
    if (result == DEM2D_OK) result = dem2di_check_number(env, "length", length, DEM2DI_FROM_0);
    if (result != DEM2D_OK) return result;
    if (!dem2di_unit(direction, &question->direction))
        return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "direction is 0");
    question->origin = origin;
    question->inverse.x = dem2di_inverse_component(question->direction.x);
    question->inverse.y = dem2di_inverse_component(question->direction.y);
    if (length > 0) question->limit = length;
    return DEM2D_OK;
}

/* The nearest of a question that has been asked, or nothing. */
static void dem2di_hit_of(const dem2di_question *question, dem2d_hit *hit) {
    *hit = question->hit;
    if (question->count > 0) hit->found = dem2di_found_of(question->world, question->item);
}

DEM2D_API dem2d_result dem2d_world_cast_ray(dem2d_world *world, dem2d_vec origin,
                                            dem2d_vec direction, double length,
                                            const dem2d_query_desc *desc, dem2d_hit *hit) {
    if (world == NULL || hit == NULL) return DEM2D_NULL_ARGUMENT;
    dem2di_question question = dem2di_question_make(world, DEM2DI_ASK_RAY, desc);
    dem2d_result result = dem2di_ray_set(&question, origin, direction, length);
    if (result == DEM2D_OK) result = dem2di_question_ask(&question);
    if (result == DEM2D_OK) dem2di_hit_of(&question, hit);
    return result;
}

/* Hits in the order of ids are sorted by distance, which for numbers that are not negative is the
   order of their bits. */
static void dem2di_hits_sort(const dem2di_question *question) {
    const dem2di_tree *tree = &question->world->tree;
    dem2di_found_sort(tree, question->count);
    for (int i = 0; i < question->count; i++) {
        dem2d_hit hit;
        (void)dem2di_item_find(question, tree->found[i].value, &hit);
        double distance = hit.distance + 0.0; /* never -0 */
        memcpy(&tree->found[i].key, &distance, sizeof distance);
    }
    dem2di_found_sort(tree, question->count);
}

DEM2D_API dem2d_result dem2d_world_cast_ray_all(dem2d_world *world, dem2d_vec origin,
                                                dem2d_vec direction, double length,
                                                const dem2d_query_desc *desc, dem2d_hit *hits,
                                                int capacity, int *count) {
    if (world == NULL || count == NULL) return DEM2D_NULL_ARGUMENT;
    dem2di_question question = dem2di_question_make(world, DEM2DI_ASK_RAY, desc);
    question.all = true;
    dem2d_result result = dem2di_check_room(world, "hits", hits, capacity);
    if (result == DEM2D_OK) result = dem2di_ray_set(&question, origin, direction, length);
    if (result == DEM2D_OK) result = dem2di_question_ask(&question);
    if (result != DEM2D_OK) return result;
    dem2di_hits_sort(&question);
    for (int i = 0; i < question.count && i < capacity; i++) {
        int item = world->tree.found[i].value;
        (void)dem2di_item_find(&question, item, &hits[i]);
        hits[i].found = dem2di_found_of(world, item);
    }
    *count = question.count;
    return DEM2D_OK;
}

DEM2D_API dem2d_result dem2d_world_nearest(dem2d_world *world, dem2d_vec point, double range,
                                           const dem2d_query_desc *desc, dem2d_hit *hit) {
    if (world == NULL || hit == NULL) return DEM2D_NULL_ARGUMENT;
    dem2di_question question = dem2di_question_make(world, DEM2DI_ASK_NEAREST, desc);
    dem2d_result result = dem2di_check_vec(&world->env, "point", point);
    if (result == DEM2D_OK)
        result = dem2di_check_number(&world->env, "range", range, DEM2DI_FROM_0);
    if (result != DEM2D_OK) return result;
    question.origin = point;
    if (range > 0) question.limit = range;
    result = dem2di_question_ask(&question);
    if (result == DEM2D_OK) dem2di_hit_of(&question, hit);
    return result;
}

DEM2D_API dem2d_result dem2d_world_particle_contacts(const dem2d_world *world, dem2d_particle_id id,
                                                     dem2d_contact_info *contacts, int capacity,
                                                     int *count) {
    if (world == NULL || count == NULL) return DEM2D_NULL_ARGUMENT;
    const dem2di_list *list = &world->list;
    int slot = dem2di_slot(world, id), open = 0;
    if (slot < 0) return dem2di_stale(world, "particle", id.index);
    dem2d_result result = dem2di_check_room(world, "contacts", contacts, capacity);
    if (result != DEM2D_OK) return result;
    for (int k = list->first[slot]; k < list->first[slot + 1]; k++) {
        dem2di_contact_iterator at = dem2di_contacts_start(false);
        at.walls = list->adjacent[k] >= list->pairs;
        at.number = list->adjacent[k];
        if (!dem2di_contact_get(world, &list->contacts, at.number, &at.contact)) continue;
        at.branch = dem2di_branch_of(&at.contact, at.walls);
        if (open < capacity) contacts[open] = dem2di_contact_of(world, &at);
        open++;
    }
    *count = open;
    return DEM2D_OK;
}

/* ============================================================================================
   >>output  Bytes to a callback or a file
   uses: config, memory
   ============================================================================================ */

/* Where bytes are written, a callback or a file, and whether all writes succeeded. */
typedef struct dem2di_writer {
    dem2d_write_fn *write;
    void *user;
    FILE *file;
    bool good;
    int sign_length; /* of the locale's decimal sign */
    char sign[MB_LEN_MAX];
} dem2di_writer;

static void dem2di_put_bytes(dem2di_writer *writer, const char *bytes, size_t count) {
    if (!writer->good || count == 0) return;
    if (writer->file != NULL)
        writer->good = fwrite(bytes, 1, count, writer->file) == count;
    else
        writer->good = writer->write(writer->user, bytes, count);
}

/* Finds the decimal sign of printf, between the digits of 0.5: in some locales a comma, in others
   a sign of two bytes. A point, which needs no change, counts as none. */
static void dem2di_writer_find_sign(dem2di_writer *writer) {
    char half[MB_LEN_MAX + 3];
    int length = snprintf(half, sizeof half, "%.1f", 0.5) - 2;
    writer->sign_length = 0;
    if (length < 1 || length > MB_LEN_MAX || half[1] == '.') return;
    writer->sign_length = length;
    memcpy(writer->sign, half + 1, (size_t)length);
}

/* Open a writer to a callback or a file; exactly one of them must be given. */
static dem2d_result dem2di_writer_open(const dem2d_env *env, dem2d_write_fn *write, void *user,
                                       const char *path, bool append, dem2di_writer *writer) {
    if (path == NULL && write == NULL) return dem2di_fail_null(env, "path and write");
    if (path != NULL && write != NULL)
        return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "both path and write are given");
    writer->write = write;
    writer->user = user;
    writer->file = path != NULL ? fopen(path, append ? "ab" : "wb") : NULL;
    writer->good = path == NULL || writer->file != NULL;
    dem2di_writer_find_sign(writer);
    return writer->good ? DEM2D_OK : dem2di_fail(env, DEM2D_IO, -1, "could not open %s", path);
}

static dem2d_result dem2di_writer_close(const dem2d_env *env, const char *path,
                                        dem2di_writer *writer) {
    if (writer->file != NULL && fclose(writer->file) != 0) writer->good = false;
    if (writer->good) return DEM2D_OK;
    if (path == NULL) return dem2di_fail(env, DEM2D_IO, -1, "the write callback failed");
    return dem2di_fail(env, DEM2D_IO, -1, "could not write %s", path);
}

/* ============================================================================================
   >>snapshot  State hash, snapshots: both follow the tables of columns and fields
   uses: config, memory, fields, support, shapes, broad, motion, world, objects, walls, list,
   measures, output
   ============================================================================================ */

/* To save, load, check and hash one number more, give it a line in the table of fields of its
   struct; an array more, a line in dem2di_columns. A number that a snapshot does not have is 0, and
   what is 0 is not hashed: older snapshots can be read, and hashes stay what they were, if 0 means
   what was the case before there was the number.

   A snapshot is a sequence of words of 8 bytes, little-endian: doubles by their bits, whole numbers
   in two's complement, names as 24 characters with zeros at the end. First a mark, a version and
   the size in bytes, then records, last a checksum of all words before it. The mark ends as lines
   end on different systems, so that a copy as text is noticed. A record is a column:
       name, number of rows, number of fields;
       of each field the name, and how many numbers it has, plus 256 if they are doubles;
       row by row the numbers.
   Columns and fields that are 0 all over are left out. How many rows a column has is known from the
   records before it. A name that is not known here is an error that tells it: a later version has
   written it, and its state must not be lost in silence. The number of the version changes only
   when these rules do. */
#define DEM2DI_SNAPSHOT_MARK 0x0A0D64326D65648Du /* 8D "dem2d" 0D 0A */
#define DEM2DI_SNAPSHOT_VERSION 4u
#define DEM2DI_SNAPSHOT_HEAD 24 /* bytes: mark, version, size */
#define DEM2DI_SNAPSHOT_TAIL 8  /* the checksum */
#define DEM2DI_NAME_WORDS 3
#define DEM2DI_FIELDS 64 /* of a column at most */

#define DEM2DI_HASH_START 0x243F6A8885A308D3u /* pi - 3: not 0, of which zeros would make 0 */

/* One to one in either argument, so that no change of a single word can be lost. */
static uint64_t dem2di_hash_word(uint64_t hash, uint64_t word) {
    hash = (hash ^ word) * 0x9E3779B97F4A7C15u; /* 2^64 / golden ratio */
    return hash ^ hash >> 32;
}

static uint64_t dem2di_word_of(const unsigned char *bytes) {
    uint64_t word = 0;
    for (int k = 0; k < 8; k++) word |= (uint64_t)bytes[k] << 8 * k;
    return word;
}

/* Word k of a name. */
static uint64_t dem2di_name_word(const char *name, int k) {
    unsigned char bytes[8 * DEM2DI_NAME_WORDS] = {0};
    memcpy(bytes, name, strlen(name));
    return dem2di_word_of(bytes + 8 * k);
}

/* --- numbers of fields --------------------------------------------------------------------------
 */

/* Bytes in memory of one of the numbers that a field has. */
static size_t dem2di_number_size(const dem2di_field *field) {
    size_t size = sizeof(double);
    if (field->type == DEM2DI_INT || field->type == DEM2DI_ENUM) size = sizeof(int);
    if (field->type == DEM2DI_ID) size = sizeof(uint32_t);
    return field->size < size ? field->size : size; /* bool, uint8_t, enums where they are short */
}

static int dem2di_numbers_of(const dem2di_field *field) {
    return (int)(field->size / dem2di_number_size(field));
}

static bool dem2di_is_real(const dem2di_field *field) {
    return field->type == DEM2DI_DOUBLE || field->type == DEM2DI_VEC;
}

/* Number k of a field as a word, and from a word that fits. */
static uint64_t dem2di_number_get(const dem2di_field *field, const void *row, int k) {
    size_t size = dem2di_number_size(field);
    const char *at = (const char *)row + field->offset + (size_t)k * size;
    uint64_t word = 0;
    int32_t half;
    if (size == 1) return *(const uint8_t *)at;
    if (size == 2) return *(const uint16_t *)(const void *)at;
    if (size == 4) memcpy(&half, at, size);
    if (size == 4) return field->type == DEM2DI_ID ? (uint32_t)half : (uint64_t)(int64_t)half;
    memcpy(&word, at, sizeof word);
    return word;
}

static void dem2di_number_set(const dem2di_field *field, void *row, int k, uint64_t word) {
    size_t size = dem2di_number_size(field);
    char *at = (char *)row + field->offset + (size_t)k * size;
    uint32_t half = (uint32_t)(word & UINT32_MAX);
    if (size == 1) *(uint8_t *)at = (uint8_t)half;
    if (size == 2) *(uint16_t *)(void *)at = (uint16_t)half;
    if (size == 4) memcpy(at, &half, size);
    if (size == 8) memcpy(at, &word, size);
}

static bool dem2di_number_fits(const dem2di_field *field, uint64_t all) {
    double value;
    int64_t whole;
    memcpy(&value, &all, sizeof value);
    memcpy(&whole, &all, sizeof whole);
    if (dem2di_is_real(field)) return dem2di_in_range(field, value);
    if (field->type == DEM2DI_BOOL) return whole == 0 || whole == 1;
    if (field->type == DEM2DI_UINT64) return true;
    if (field->type == DEM2DI_ID) return whole >= 0 && whole <= UINT32_MAX;
    return (field->type == DEM2DI_INT64 || (whole >= INT_MIN && whole <= INT_MAX)) &&
           dem2di_in_range(field, (double)whole);
}

/* --- rows ---------------------------------------------------------------------------------------
 */

/* How many there are of a column in its object, a world or a slot_shape. */
static int dem2di_rows(const void *object, const dem2di_column *column) {
    int rows[DEM2DI_GROUPS] = {0};
    if (column->group >= DEM2DI_SHAPE) {
        const dem2d_shape *shape = &((const dem2di_slot_shape *)object)->shape;
        rows[DEM2DI_SHAPE] = 1;
        rows[DEM2DI_SHAPE_COUNT] = shape->count;
        rows[DEM2DI_SHAPE_PARTS] = shape->parts;
        rows[DEM2DI_SHAPE_BLOCKS] = dem2di_block_count(shape->count);
        rows[DEM2DI_SHAPE_SECTORS] = DEM2DI_RHO_SECTORS;
        bool there = column->group == DEM2DI_SHAPE || dem2di_column_get(object, column) != NULL;
        return there ? rows[column->group] : 0;
    }
    const dem2d_world *w = (const dem2d_world *)object;
    rows[DEM2DI_WORLD] = 1;
    rows[DEM2DI_TEMPLATES] = w->template_count;
    rows[DEM2DI_MATERIALS] = w->material_count;
    rows[DEM2DI_LAWS] = w->material_count * w->material_count;
    rows[DEM2DI_IDS] = w->id_count;
    rows[DEM2DI_RANKS] = w->named ? w->id_count : 0;
    rows[DEM2DI_BODIES] = w->body_count;
    rows[DEM2DI_NAMES] = w->named ? w->body_count : 0;
    rows[DEM2DI_LOADS] = w->loaded ? w->body_count : 0;
    rows[DEM2DI_DISPLACEMENTS] = w->plan.turns ? w->body_count : 0;
    rows[DEM2DI_MADE] = w->redirected ? w->body_count : 0;
    rows[DEM2DI_WALLS] = w->wall_count;
    rows[DEM2DI_PARTS] = w->part_count;
    for (int k = DEM2DI_KEYS; k < DEM2DI_ADJACENCY; k++)
        rows[k] = w->list.count -
                  dem2di_contacts_begin(&w->plan, w->list.discs, w->list.count, (dem2di_group)k);
    return rows[column->group];
}

/* Does something with a column of an object. */
typedef void dem2di_column_fn(void *context, const void *object, const dem2di_column *column);

/* The columns of a world, then those of each of its shapes. */
static void dem2di_for_columns(const dem2d_world *w, dem2di_column_fn *act, void *context) {
    const dem2di_column *shapes = dem2di_columns, *end = dem2di_columns + DEM2DI_COLUMNS;
    for (; shapes->group < DEM2DI_SHAPE; shapes++) act(context, w, shapes);
    for (int i = 0; i < w->template_count; i++) {
        dem2di_slot_shape object;
        if (w->templates[i].shape == NULL) continue;
        object.slot = i;
        object.shape = *w->templates[i].shape;
        for (const dem2di_column *column = shapes; column < end; column++)
            act(context, &object, column);
    }
}

/* Row 0 of a column: one that is alone is the object itself. */
static void *dem2di_rows_start(const void *object, const dem2di_column *column) {
    void *itself;
    memcpy(&itself, &object, sizeof itself);
    bool alone = column->group == DEM2DI_WORLD || column->group == DEM2DI_SHAPE;
    return alone ? itself : dem2di_column_get(object, column);
}

/* --- the hash -----------------------------------------------------------------------------------
 */

/* The hash of the columns so far, and of the fields of one more. */
typedef struct dem2di_hashing {
    const dem2d_world *world;
    uint64_t hash;
    const dem2di_column *column;
    uint64_t field[DEM2DI_FIELDS];
} dem2di_hashing;

/* Numbers that are not 0, each with its place in the column. */
static void dem2di_hash_row(dem2di_hashing *hashing, uint64_t place, const void *row) {
    for (int f = 0; f < hashing->column->count; f++) {
        const dem2di_field *field = &hashing->column->fields[f];
        for (int k = 0; k < dem2di_numbers_of(field); k++) {
            uint64_t number = dem2di_number_get(field, row, k), *hash = &hashing->field[f];
            if (number == 0) continue;
            *hash = dem2di_hash_word(dem2di_hash_word(*hash, place << 8 | (uint64_t)k), number);
        }
    }
}

/* Fields by name, so that one that is new, and 0 all over, leaves no trace. */
static void dem2di_hash_fields(dem2di_hashing *hashing) {
    for (int f = 0; f < hashing->column->count; f++) {
        if (hashing->field[f] == 0) continue;
        for (int k = 0; k < DEM2DI_NAME_WORDS; k++) {
            uint64_t column = dem2di_name_word(hashing->column->name, k);
            uint64_t field = dem2di_name_word(hashing->column->fields[f].name, k);
            hashing->hash = dem2di_hash_word(dem2di_hash_word(hashing->hash, column), field);
        }
        hashing->hash = dem2di_hash_word(hashing->hash, hashing->field[f]);
    }
}

/* A row that is made for the hash. */
typedef union dem2di_row {
    dem2di_state state;
    dem2di_key key;
    double number;
} dem2di_row;

/* Has a column a row for each body? */
static bool dem2di_of_bodies(dem2di_group group) {
    return group >= DEM2DI_BODIES && group <= DEM2DI_MADE;
}

/* Row of a hashed column for a place in the order of ids; NULL: nothing is there. Poses are as a
   caller sees them: a refused step may have changed how rotations are held. */
static const void *dem2di_hashed_row(const dem2d_world *w, const dem2di_column *column, int place,
                                     dem2di_row *made) {
    dem2di_group group = column->group;
    int slot = place;
    if (group == DEM2DI_WORLD) return w;
    const char *start = (const char *)dem2di_column_get(w, column);
    if (dem2di_of_bodies(group)) slot = w->ids[place].slot;
    if (slot < 0 || (group == DEM2DI_IDS && w->ids[place].slot < 0)) return NULL;
    if (group == DEM2DI_WALLS && !w->walls[place].alive) return NULL;
    if (group == DEM2DI_PARTS && w->walls[w->parts[place].wall].count == 1)
        return NULL; /* follows from the wall's desc */
    if (group == DEM2DI_TEMPLATES && w->templates[place].shape == NULL) return NULL;
    const char *row = start + (size_t)slot * column->size;
    if (column->fields != dem2di_state_fields) return row;
    memcpy(&made->state, row, sizeof made->state);
    made->state.q = dem2di_pose_of(w, (const dem2di_state *)(const void *)start, slot).rotation;
    return made;
}

/* Row of a column of contacts for a closed one of the last force pass, by ids; NULL: it has none.
 */
static const void *dem2di_contact_row(const dem2d_world *w, const dem2di_column *column,
                                      const dem2di_contact_iterator *iterator, dem2di_row *made) {
    const dem2di_list *list = &w->list;
    const dem2di_key *key = &list->keys[iterator->number];
    if (column->fields == dem2di_arms_fields)
        return &iterator->contact.arms; /* circles have none */
    if (column->treatment & DEM2DI_STORED) {
        int begin = dem2di_contacts_begin(&w->plan, list->discs, list->count, column->group);
        const char *start = (const char *)dem2di_column_get(w, column);
        if (iterator->number < begin) return NULL;
        const char *row = start + (size_t)(iterator->number - begin) * column->size;
        if (column->fields != dem2di_finite_field) return row;
        memcpy(&made->number, row, sizeof made->number);
        made->number += 0; /* not -0: a spring may have been there or not */
        return made;
    }
    made->key.a = w->bodies[key->a].index;
    made->key.b = w->bodies[iterator->walls ? key->a : key->b].index;
    if (!iterator->walls) return made;
    int wall = dem2di_wall_of(w, iterator->number); /* its first part as a wall of one part */
    made->key.b = -1 - wall - (key->b - w->walls[wall].first);
    return made;
}

static void dem2di_hash_contacts(dem2di_hashing *hashing) {
    const dem2d_world *w = hashing->world;
    dem2di_row made;
    uint64_t place = 0;
    dem2di_contact_iterator iterator = dem2di_contacts_start(false);
    for (; dem2di_next_contact(w, &iterator); place++) {
        const void *row = dem2di_contact_row(w, hashing->column, &iterator, &made);
        if (row != NULL) dem2di_hash_row(hashing, place, row);
    }
}

static void dem2di_hash_column(void *context, const void *object, const dem2di_column *column) {
    dem2di_hashing *hashing = (dem2di_hashing *)context;
    dem2di_group group = column->group;
    dem2di_row made;
    if (!(column->treatment & DEM2DI_HASHED)) return;
    hashing->column = column;
    memset(hashing->field, 0, sizeof hashing->field);
    bool contacts = group >= DEM2DI_KEYS && group < DEM2DI_SHAPE;
    bool by_id = dem2di_of_bodies(group);
    int rows = dem2di_rows(object, column);
    if (by_id && rows > 0) rows = hashing->world->id_count;
    const char *row = (const char *)dem2di_rows_start(object, column);
    if (contacts) dem2di_hash_contacts(hashing);
    for (int i = 0; i < rows && !contacts; i++, row += column->size) {
        const void *at = row;
        if (group < DEM2DI_SHAPE) at = dem2di_hashed_row(hashing->world, column, i, &made);
        if (at != NULL) dem2di_hash_row(hashing, (uint64_t)i, at);
    }
    dem2di_hash_fields(hashing);
}

DEM2D_API uint64_t dem2d_world_hash(const dem2d_world *world) {
    if (world == NULL) return 0;
    dem2di_hashing hashing;
    memset(&hashing, 0, sizeof hashing);
    hashing.world = world;
    hashing.hash = DEM2DI_HASH_START;
    dem2di_for_columns(world, dem2di_hash_column, &hashing);
    uint64_t hash = dem2di_hash_word(hashing.hash, 0); /* low bits come from high ones too */
    return hash != 0 ? hash : 1;
}

/* --- saving -------------------------------------------------------------------------------------
 */

#define DEM2DI_CHUNK 4096 /* bytes written at once */

/* Words on their way, or only their number. */
typedef struct dem2di_saver {
    bool counts;
    uint64_t words, hash;
    size_t used;
    unsigned char chunk[DEM2DI_CHUNK];
    dem2di_writer writer;
} dem2di_saver;

static void dem2di_saver_start(dem2di_saver *saver, bool counts) {
    memset(saver, 0, sizeof *saver);
    saver->counts = counts;
    saver->hash = DEM2DI_HASH_START;
}

static void dem2di_saver_flush(dem2di_saver *saver) {
    dem2di_put_bytes(&saver->writer, (const char *)saver->chunk, saver->used);
    saver->used = 0;
}

static void dem2di_put_word(dem2di_saver *saver, uint64_t word) {
    saver->words++;
    if (saver->counts) return;
    saver->hash = dem2di_hash_word(saver->hash, word);
    for (int k = 0; k < 8; k++) saver->chunk[saver->used++] = (unsigned char)(word >> 8 * k & 255);
    if (saver->used == DEM2DI_CHUNK) dem2di_saver_flush(saver);
}

static void dem2di_put_name(dem2di_saver *saver, const char *name) {
    for (int k = 0; k < DEM2DI_NAME_WORDS; k++) dem2di_put_word(saver, dem2di_name_word(name, k));
}

/* Which fields of a column have a number that is not 0: bits. */
static uint64_t dem2di_fields_used(const void *object, const dem2di_column *column) {
    uint64_t used = (column->treatment & DEM2DI_FIRST) != 0; /* one tells how many rows there are */
    const char *row = (const char *)dem2di_rows_start(object, column);
    for (int left = dem2di_rows(object, column); left > 0; left--, row += column->size)
        for (int f = 0; f < column->count; f++)
            for (int k = 0; k < dem2di_numbers_of(&column->fields[f]) && !(used >> f & 1); k++)
                if (dem2di_number_get(&column->fields[f], row, k) != 0) used |= (uint64_t)1 << f;
    return used;
}

static void dem2di_put_rows(dem2di_saver *saver, const void *object, const dem2di_column *column,
                            uint64_t used) {
    const char *row = (const char *)dem2di_rows_start(object, column);
    for (int left = dem2di_rows(object, column); left > 0; left--, row += column->size)
        for (int f = 0; f < column->count; f++)
            for (int k = 0; k < dem2di_numbers_of(&column->fields[f]) && (used >> f & 1); k++)
                dem2di_put_word(saver, dem2di_number_get(&column->fields[f], row, k));
}

static void dem2di_put_column(void *context, const void *object, const dem2di_column *column) {
    dem2di_saver *saver = (dem2di_saver *)context;
    int rows = dem2di_rows(object, column);
    uint64_t used = column->name != NULL ? dem2di_fields_used(object, column) : 0, fields = 0;
    if (rows == 0 || used == 0) return;
    for (int f = 0; f < column->count; f++) fields += used >> f & 1;
    dem2di_put_name(saver, column->name);
    dem2di_put_word(saver, (uint64_t)rows);
    dem2di_put_word(saver, fields);
    for (int f = 0; f < column->count; f++) {
        if (!(used >> f & 1)) continue;
        uint64_t doubles = dem2di_is_real(&column->fields[f]) ? 256 : 0;
        dem2di_put_name(saver, column->fields[f].name);
        dem2di_put_word(saver, (uint64_t)dem2di_numbers_of(&column->fields[f]) + doubles);
    }
    dem2di_put_rows(saver, object, column, used);
}

/* To where the saver writes, which is closed. */
static dem2d_result dem2di_save(const dem2d_world *world, const char *path, dem2di_saver *saver) {
    dem2di_saver sizing;
    dem2di_saver_start(&sizing, true);
    dem2di_for_columns(world, dem2di_put_column, &sizing);
    dem2di_put_word(saver, DEM2DI_SNAPSHOT_MARK);
    dem2di_put_word(saver, DEM2DI_SNAPSHOT_VERSION);
    dem2di_put_word(saver, DEM2DI_SNAPSHOT_HEAD + 8 * sizing.words + DEM2DI_SNAPSHOT_TAIL);
    dem2di_for_columns(world, dem2di_put_column, saver);
    dem2di_put_word(saver, saver->hash);
    dem2di_saver_flush(saver);
    return dem2di_writer_close(&world->env, path, &saver->writer);
}

/* Aside first: whatever happens, the path holds the old file or all of the new one. */
static dem2d_result dem2di_save_aside(const dem2d_world *world, const char *path, const char *aside,
                                      dem2di_saver *saver) {
    const dem2d_env *env = &world->env;
    dem2d_result result = dem2di_writer_open(env, NULL, NULL, aside, false, &saver->writer);
    if (result != DEM2D_OK) return result;
    result = dem2di_save(world, aside, saver);
#if defined(_WIN32)
    if (result == DEM2D_OK) (void)remove(path); /* rename does not replace there */
#endif
    if (result == DEM2D_OK && rename(aside, path) != 0)
        result = dem2di_fail(env, DEM2D_IO, -1, "could not rename %s to %s", aside, path);
    if (result != DEM2D_OK) (void)remove(aside);
    return result;
}

DEM2D_API dem2d_result dem2d_world_save(const dem2d_world *world, const dem2d_save_desc *desc,
                                        const char *path) {
    dem2d_save_desc plain;
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    memset(&plain, 0, sizeof plain);
    if (desc == NULL) desc = &plain;
    const dem2d_env *env = &world->env;
    dem2di_saver saver;
    dem2di_saver_start(&saver, false);
    if (path == NULL || desc->write != NULL) { /* or neither, or both: that is told there */
        dem2d_result result =
            dem2di_writer_open(env, desc->write, desc->user, path, false, &saver.writer);
        return result == DEM2D_OK ? dem2di_save(world, path, &saver) : result;
    }
    static const char part[] = ".part";
    size_t length = strlen(path), room = length + sizeof part;
    char *aside = (char *)dem2di_allocate(&world->user_env, room, 1);
    if (aside == NULL) return dem2di_out_of_memory(world, "a file name");
    memcpy(aside, path, length);
    memcpy(aside + length, part, sizeof part);
    dem2d_result result = dem2di_save_aside(world, path, aside, &saver);
    dem2di_release(&world->user_env, aside, room, 1);
    return result;
}

/* --- loading ------------------------------------------------------------------------------------
 */

/* A world that is being loaded. After a failure nothing more is done, and it must not be used. */
typedef struct dem2di_loader {
    const dem2d_load_desc *desc;
    dem2d_world *world;
    const dem2d_env *env;
    dem2d_result result;             /* the first failure */
    const unsigned char *next, *end; /* what is left */
    uint64_t seen;                   /* columns: bits; of shapes those of the last one */
    dem2di_slot_shape shape;         /* the last one */
} dem2di_loader;

static bool dem2di_load_good(const dem2di_loader *loader) {
    return loader->result == DEM2D_OK;
}

static void dem2di_load_expect(dem2di_loader *loader, bool holds, const char *else_what) {
    if (dem2di_load_good(loader) && !holds)
        loader->result = dem2di_fail(loader->env, DEM2D_FORMAT, -1, "snapshot: %s", else_what);
}

/* A check has failed, and has told the log. */
static void dem2di_load_check(dem2di_loader *loader, dem2d_result result) {
    if (dem2di_load_good(loader) && result != DEM2D_OK) loader->result = DEM2D_FORMAT;
}

static void dem2di_load_room(dem2di_loader *loader, bool reserved) {
    if (dem2di_load_good(loader) && !reserved)
        loader->result = dem2di_fail(loader->env, DEM2D_OUT_OF_MEMORY, -1, "no memory for a world");
}

/* An error that names a column and, unless it is NULL, a field. */
static void dem2di_load_refuse(dem2di_loader *loader, dem2d_result result, const char *what,
                               const char *column, const char *field) {
    if (!dem2di_load_good(loader)) return;
    loader->result =
        dem2di_fail(loader->env, result, -1, "snapshot: %s: column %s%s%s", what, column,
                    field != NULL ? ", field " : "", field != NULL ? field : "");
}

static uint64_t dem2di_take_word(dem2di_loader *loader) {
    dem2di_load_expect(loader, loader->end - loader->next >= 8, "it ends within a record");
    if (!dem2di_load_good(loader)) return 0;
    loader->next += 8;
    return dem2di_word_of(loader->next - 8);
}

/* A name of at most 24 characters; what can't be printed becomes '?'. */
static void dem2di_take_name(dem2di_loader *loader, char name[8 * DEM2DI_NAME_WORDS + 1]) {
    for (int k = 0; k < 8 * DEM2DI_NAME_WORDS; k += 8) {
        uint64_t word = dem2di_take_word(loader);
        for (int i = 0; i < 8; i++) {
            int byte = (int)(word >> 8 * i & 255);
            name[k + i] = (char)(byte == 0 || (byte > ' ' && byte <= '~') ? byte : '?');
        }
    }
    name[8 * DEM2DI_NAME_WORDS] = 0;
}

/* A column of a snapshot: the fields that it has, and how many numbers of each. */
typedef struct dem2di_record {
    const dem2di_column *column;
    void *object;
    uint64_t rows, fields, width, given; /* words of a row; which fields: bits */
    const dem2di_field *field[DEM2DI_FIELDS];
    int numbers[DEM2DI_FIELDS];
} dem2di_record;

/* The next field of a record: one that is known, of the same type, of no more numbers. */
static void dem2di_take_field(dem2di_loader *loader, dem2di_record *record) {
    const dem2di_column *column = record->column;
    char name[8 * DEM2DI_NAME_WORDS + 1];
    int f = 0;
    dem2di_take_name(loader, name);
    uint64_t numbers = dem2di_take_word(loader);
    while (f < column->count && strcmp(column->fields[f].name, name) != 0) f++;
    if (f == column->count) {
        dem2di_load_refuse(loader, DEM2D_FORMAT_VERSION, "not known here", column->name, name);
        return;
    }
    const dem2di_field *field = &column->fields[f];
    if (dem2di_is_real(field)) numbers -= 256;
    if ((record->given >> f & 1) || numbers < 1 || numbers > (uint64_t)dem2di_numbers_of(field)) {
        dem2di_load_refuse(loader, DEM2D_FORMAT, "of another type", column->name, name);
        return;
    }
    record->field[record->fields] = field;
    record->numbers[record->fields++] = (int)numbers;
    record->width += numbers;
    record->given |= (uint64_t)1 << f;
}

/* May the fields that are not `given` be 0? */
static void dem2di_load_zeros(dem2di_loader *loader, const dem2di_column *column, uint64_t given) {
    for (int f = 0; f < column->count; f++)
        if (!(given >> f & 1) && !dem2di_number_fits(&column->fields[f], 0))
            dem2di_load_refuse(loader, DEM2D_FORMAT, "missing", column->name,
                               column->fields[f].name);
}

static void dem2di_load_reserve(dem2di_loader *loader, const dem2di_column *column, int rows) {
    if (column->group == DEM2DI_WORLD || column->group >= DEM2DI_SHAPE) return;
    if (dem2di_load_good(loader))
        dem2di_load_room(loader, dem2di_group_reserve(loader->world, column->group, rows));
}

static void dem2di_take_rows(dem2di_loader *loader, const dem2di_record *record) {
    const dem2di_column *column = record->column;
    char *row = (char *)dem2di_rows_start(record->object, column);
    for (uint64_t i = 0; i < record->rows && dem2di_load_good(loader); i++, row += column->size)
        for (uint64_t f = 0; f < record->fields; f++)
            for (int k = 0; k < record->numbers[f]; k++) {
                uint64_t word = dem2di_take_word(loader);
                if (dem2di_number_fits(record->field[f], word))
                    dem2di_number_set(record->field[f], row, k, word);
                else
                    dem2di_load_refuse(loader, DEM2D_FORMAT, "out of range", column->name,
                                       record->field[f]->name);
            }
}

/* Columns that the snapshot does not have are 0. The first of a group must be there: its bytes show
   that there are so many rows. */
static void dem2di_load_missing(dem2di_loader *loader, const void *object, bool shape) {
    for (int k = 0; k < DEM2DI_COLUMNS && dem2di_load_good(loader); k++) {
        const dem2di_column *column = &dem2di_columns[k];
        if ((column->group >= DEM2DI_SHAPE) != shape || (loader->seen >> k & 1)) continue;
        int rows = dem2di_rows(object, column);
        if (rows == 0) continue;
        if (column->treatment & DEM2DI_FIRST)
            dem2di_load_refuse(loader, DEM2D_FORMAT, "missing", column->name, NULL);
        dem2di_load_zeros(loader, column, 0);
        dem2di_load_reserve(loader, column, rows);
    }
}

/* Before the next shape, and after the last: has it all arrays of its type? */
static void dem2di_load_shape_end(dem2di_loader *loader) {
    if (loader->shape.shape.circumscribed > 0) dem2di_load_missing(loader, &loader->shape, true);
    memset(&loader->shape, 0, sizeof loader->shape);
    for (int k = 0; k < DEM2DI_COLUMNS; k++)
        if (dem2di_columns[k].group >= DEM2DI_SHAPE) loader->seen &= ~((uint64_t)1 << k);
}

/* The column of the next record: of the world, or of its last shape. */
static void dem2di_take_column(dem2di_loader *loader, dem2di_record *record) {
    char name[8 * DEM2DI_NAME_WORDS + 1];
    int k = 0;
    memset(record, 0, sizeof *record);
    dem2di_take_name(loader, name);
    while (k < DEM2DI_COLUMNS &&
           (dem2di_columns[k].name == NULL || strcmp(dem2di_columns[k].name, name) != 0))
        k++;
    if (k == DEM2DI_COLUMNS) {
        dem2di_load_refuse(loader, DEM2D_FORMAT_VERSION, "not known here", name, NULL);
        return;
    }
    record->column = &dem2di_columns[k];
    record->object = loader->world;
    if (record->column->group == DEM2DI_SHAPE) dem2di_load_shape_end(loader);
    if (record->column->group >= DEM2DI_SHAPE) record->object = &loader->shape;
    if (loader->seen >> k & 1) dem2di_load_refuse(loader, DEM2D_FORMAT, "there twice", name, NULL);
    loader->seen |= (uint64_t)1 << k;
}

/* A custom shape's function is the caller's. */
static void dem2di_load_custom(dem2di_loader *loader, dem2d_shape *shape) {
    const dem2d_load_desc *desc = loader->desc;
    const dem2d_custom_desc *found = NULL;
    if (desc->custom != NULL) found = desc->custom(desc->custom_user, shape->function_tag);
    if (found == NULL || found->support == NULL) {
        loader->result = dem2di_fail(loader->env, DEM2D_NULL_ARGUMENT, -1,
                                     "custom: no support function for tag %d", shape->function_tag);
        return;
    }
    shape->function = found->support;
    shape->function_user = found->user;
}

/* A shape whose numbers are known is made; its arrays come next, with 8 bytes an element at least.
 */
static void dem2di_load_shape(dem2di_loader *loader) {
    dem2d_world *w = loader->world;
    const dem2di_slot_shape given = loader->shape;
    int slot = given.slot, count = given.shape.count, parts = given.shape.parts;
    dem2d_shape_type type = given.shape.type;
    int least = type == DEM2D_POLYGON ? 3 : type == DEM2D_BEZIER ? 2 : 0;
    bool counts = least > 0 || type == DEM2D_FOURIER;
    int64_t most = (loader->end - loader->next) / 8;
    dem2di_load_expect(loader, slot < w->capacity[DEM2DI_TEMPLATES] && slot < w->template_count,
                       "a shape without a slot");
    if (dem2di_load_good(loader))
        dem2di_load_expect(loader, w->templates[slot].shape == NULL, "two shapes in a slot");
    dem2di_load_expect(loader, count >= least && count <= most && (counts || count == 0),
                       "count of a shape");
    dem2di_load_expect(loader,
                       type == DEM2D_BEZIER ? parts >= 3 && parts <= most
                                            : parts == (type == DEM2D_POLYGON ? count : 0),
                       "parts of a shape");
    if (!dem2di_load_good(loader)) return;
    dem2d_shape *shape = dem2di_shape_allocate(&w->env, type, count, parts);
    if (shape == NULL) {
        loader->result = DEM2D_OUT_OF_MEMORY; /* the log knows */
        return;
    }
    w->templates[slot].shape = shape;
    loader->shape.shape = *shape;
    for (int f = 0; f < (int)(sizeof dem2di_shape_fields / sizeof *dem2di_shape_fields); f++) {
        const dem2di_field *field = &dem2di_shape_fields[f];
        for (int k = 0; k < dem2di_numbers_of(field); k++)
            dem2di_number_set(field, &loader->shape, k, dem2di_number_get(field, &given, k));
    }
    if (type == DEM2D_CUSTOM) dem2di_load_custom(loader, &loader->shape.shape);
    *shape = loader->shape.shape;
}

static void dem2di_load_record(dem2di_loader *loader) {
    dem2di_record record;
    dem2di_take_column(loader, &record);
    uint64_t rows = dem2di_take_word(loader), fields = dem2di_take_word(loader);
    while (fields-- > 0 && dem2di_load_good(loader)) dem2di_take_field(loader, &record);
    if (!dem2di_load_good(loader)) return;
    const dem2di_column *column = record.column;
    uint64_t left = (uint64_t)(loader->end - loader->next) / 8;
    int expected = dem2di_rows(record.object, column); /* as the records before it say */
    record.rows = rows;
    if (expected <= 0 || rows != (uint64_t)expected || record.width == 0 ||
        rows > left / record.width)
        dem2di_load_refuse(loader, DEM2D_FORMAT, "another number of rows", column->name, NULL);
    dem2di_load_zeros(loader, column, record.given);
    dem2di_load_reserve(loader, column, expected);
    if (dem2di_load_good(loader)) dem2di_take_rows(loader, &record);
    if (dem2di_load_good(loader) && column->group == DEM2DI_SHAPE) dem2di_load_shape(loader);
}

/* --- what has been loaded: does it fit together, and what follows of it --------------------------
 */

static void dem2di_check_settings(dem2di_loader *loader) {
    dem2d_world *w = loader->world;
    const dem2d_load_desc *desc = loader->desc;
    dem2di_load_expect(loader, w->timed_at <= w->steps, "timed_at is to come");
    dem2di_load_expect(loader, w->listed_at <= w->steps, "listed_at is to come");
    dem2di_load_expect(loader, w->list.discs <= w->list.pairs && w->list.pairs <= w->list.count,
                       "kinds of contacts");
    dem2di_load_expect(loader, w->plan.material < (w->material_count > 0 ? w->material_count : 1),
                       "material of the plan");
    if (!dem2di_load_good(loader) || !w->has_law) return;
    if (desc->law == NULL || desc->law_tag != w->law_tag) {
        const char *what = desc->law == NULL ? "law is NULL: law_tag" : "law_tag";
        loader->result = dem2di_fail(loader->env, DEM2D_NULL_ARGUMENT, -1,
                                     "%s = %d, the world's is %d", what, desc->law_tag, w->law_tag);
        return;
    }
    w->law = desc->law;
    w->law_user = desc->law_user;
}

/* Tables of shapes follow from their numbers. */
static void dem2di_finish_shapes(dem2di_loader *loader) {
    dem2di_load_shape_end(loader);
    for (int i = 0; i < loader->world->template_count && dem2di_load_good(loader); i++) {
        dem2d_shape *shape = loader->world->templates[i].shape;
        if (shape == NULL) continue;
        for (int n = 1; shape->blocks != NULL && n <= shape->count; n++) {
            const dem2di_block *block = &shape->blocks[(n - 1) / 4];
            dem2di_fourier_term(shape, n, block->a[(n - 1) % 4], block->b[(n - 1) % 4]);
        }
        if (shape->sectors > 0) dem2di_fill_sectors(shape);
        dem2di_find_edges(shape);
    }
}

/* A particle has a template and a material, and what follows of them. */
static void dem2di_finish_body(dem2di_loader *loader, int slot) {
    dem2d_world *w = loader->world;
    const dem2di_body *body = &w->bodies[slot];
    for (int next = 0; next < 2; next++) {
        dem2d_rot q = (next == 1 ? w->now : w->before)[slot].q;
        double off = w->plan.turns ? q.c * q.c + q.s * q.s - 1 : q.c / 2147483648.0;
        dem2di_load_expect(loader, fabs(off) < (w->plan.turns ? 1e-9 : 1), "no rotation");
    }
    dem2di_load_expect(loader, w->redirected || !body->redirected, "a particle redirected");
    dem2di_load_expect(loader, body->material < w->material_count, "a particle without a material");
    w->holes += body->shape_index < 0;
    if (body->shape_index < 0 || !dem2di_load_good(loader)) return;
    bool there =
        body->shape_index < w->template_count && w->templates[body->shape_index].shape != NULL;
    dem2di_load_expect(loader, there, "a particle without a shape");
    if (!dem2di_load_good(loader)) return;
    dem2di_template *place = &w->templates[body->shape_index];
    double mass = dem2di_body_mass(w, body), inertia = dem2di_body_inertia(w, body);
    dem2di_load_check(loader, dem2di_check_number(loader->env, "mass", mass, DEM2DI_POSITIVE));
    dem2di_load_check(loader,
                      dem2di_check_number(loader->env, "inertia", inertia, DEM2DI_POSITIVE));
    place->users++;
    w->inverse[slot] = dem2di_inverse_of(w, body);
    w->now[slot].radius = w->before[slot].radius = place->shape->circumscribed * body->scale;
    if (w->plan.turns) w->lever[slot] = dem2di_lever_of(w, slot);
}

/* Ids in use and particles lead to each other, and the free ids are in one list. */
static bool dem2di_ids_agree(const dem2d_world *w) {
    int unused = 0, index = w->free_id;
    for (int i = 0; i < w->id_count; i++) {
        int slot = w->ids[i].slot;
        unused += slot < 0;
        if (slot < 0) continue;
        if (slot >= w->body_count || w->bodies[slot].index != i || w->bodies[slot].shape_index < 0)
            return false;
    }
    for (int slot = 0; slot < w->body_count; slot++) {
        const dem2di_body *body = &w->bodies[slot];
        if (body->index >= w->id_count) return false;
        if (body->shape_index >= 0 && w->ids[body->index].slot != slot) return false;
    }
    for (; unused > 0 && index >= 0 && index < w->id_count; unused--) {
        if (w->ids[index].slot >= 0) return false;
        index = -2 - w->ids[index].slot;
    }
    return unused == 0 && index == -1;
}

/* Ranks by the ids, or by the order of names, in which each id has to be once. */
static void dem2di_finish_ranks(dem2di_loader *loader) {
    dem2d_world *w = loader->world;
    for (int slot = 0; slot < w->body_count; slot++) w->bodies[slot].rank = w->bodies[slot].index;
    if (!w->named) return;
    for (int i = 0; i < w->id_count; i++) w->order[i].rank = -1;
    for (int i = 0; i < w->id_count && dem2di_load_good(loader); i++) {
        int index = w->order[i].index;
        bool once = index < w->id_count && w->order[index].rank < 0;
        dem2di_load_expect(loader, once, "no order of ids");
        if (once) w->order[index].rank = i;
    }
    if (dem2di_load_good(loader)) dem2di_ranks_set(w);
}

/* A wall of one part has that of its desc, of which snapshots before 0.7 say no more. */
static void dem2di_finish_wall(dem2di_loader *loader, int slot, int first) {
    dem2d_world *w = loader->world;
    dem2di_wall *wall = &w->walls[slot];
    wall->first = first;
    wall->span[0] = wall->span[1] = -1;
    if (!wall->alive) return;
    dem2d_vec n = wall->desc.normal;
    dem2di_load_check(loader, dem2di_check_wall(w, &wall->desc));
    dem2di_load_expect(loader, dem2di_is_unit(n.x, n.y), "a normal is not of unit length");
    if (dem2di_load_good(loader) && !dem2di_line_make(w, &wall->desc))
        loader->result = DEM2D_OUT_OF_MEMORY; /* the log knows */
    dem2di_load_expect(loader, wall->first < w->part_count && w->parts[wall->first].wall == slot,
                       "a wall without a part");
    if (!dem2di_load_good(loader)) return;
    wall->count = 1;
    dem2di_part_describe(wall, &w->parts[wall->first]);
    dem2di_surfaces_set(w, slot);
    for (int i = 0; i < 2; i++) {
        if (wall->desc.spans[i].generation == 0) continue;
        wall->span[i] = (int)wall->desc.spans[i].index;
        w->walls[wall->span[i]].users++;
    }
}

/* Snapshots before 0.7 have no parts: each wall gets one, and contacts are with this. */
static void dem2di_load_parts(dem2di_loader *loader) {
    dem2d_world *w = loader->world;
    int count = 0;
    if (w->part_count > 0) return;
    for (int j = 0; j < w->wall_count; j++) count += w->walls[j].alive;
    dem2di_load_room(loader, dem2di_group_reserve(w, DEM2DI_PARTS, count));
    if (!dem2di_load_good(loader)) return;
    for (int place = 0; place < w->wall_count; place++) {
        int j = w->walls[place].placed;
        w->walls[j].first = w->part_count;
        if (w->walls[j].alive) w->parts[w->part_count++].wall = j;
    }
    for (int i = w->list.pairs; i < w->list.count; i++) {
        dem2di_key *key = &w->list.keys[i];
        if (key->a < 0) continue;
        bool there = key->b < w->wall_count && w->walls[key->b].alive;
        dem2di_load_expect(loader, there, "no such contact");
        if (there) key->b = w->walls[key->b].first;
    }
}

static void dem2di_finish_walls(dem2di_loader *loader) {
    dem2d_world *w = loader->world;
    int parts = 0;
    for (int j = 0; j < w->wall_count; j++) w->walls[j].rank = w->walls[j].placed = j;
    for (int j = 0; j < w->wall_count; j++) dem2di_wall_rank(w, j, j + 1);
    dem2di_load_parts(loader);
    for (int place = 0; place < w->wall_count && dem2di_load_good(loader); place++) {
        int j = w->walls[place].placed;
        dem2di_finish_wall(loader, j, parts);
        parts += w->walls[j].count;
    }
    dem2di_load_expect(loader, parts == w->part_count, "parts without a wall");
}

/* A contact is of two that live, in the kind it is listed in; a forgotten one may be anything. */
static bool dem2di_key_sound(const dem2d_world *w, int contact) {
    const dem2di_key *key = &w->list.keys[contact];
    if (key->a < 0) return w->list_stale && !(w->list.contacts.depth[contact] > 0);
    if (key->a >= w->body_count || w->bodies[key->a].shape_index < 0) return false;
    if (contact >= w->list.pairs) return key->b < w->part_count;
    if (key->b >= w->body_count || w->bodies[key->b].shape_index < 0) return false;
    const dem2di_body *a = &w->bodies[key->a], *b = &w->bodies[key->b];
    bool round = dem2di_shape_of(w, a)->type == DEM2D_CIRCLE &&
                 dem2di_shape_of(w, b)->type == DEM2D_CIRCLE && dem2di_has_disc_kernel(w, &w->plan);
    return a != b && round == (contact < w->list.discs) && (round || w->plan.turns);
}

/* May the next step go by the plan without a look at the scene? */
static bool dem2di_plan_holds(const dem2d_world *w) {
    const dem2di_plan *plan = &w->plan;
    if (w->list_stale || w->body_count == 0) return true;
    if (w->holes > 0) return false;
    if (w->plan_due > 0) return true;
    dem2di_plan need = dem2di_plan_make(w);
    return dem2di_plan_fits(plan, &need) && plan->spin >= need.spin &&
           plan->joints >= need.joints && plan->held >= need.held &&
           (!plan->one_law || (need.one_law && plan->material == need.material));
}

/* The contacts of each particle, and what a step expects of the list. */
static void dem2di_finish_list(dem2di_loader *loader) {
    dem2d_world *w = loader->world;
    dem2di_list *list = &w->list;
    for (int i = 0; i < list->count && dem2di_load_good(loader); i++)
        dem2di_load_expect(loader, dem2di_key_sound(w, i), "no such contact");
    if (!dem2di_load_good(loader)) return;
    dem2di_load_expect(loader, dem2di_plan_holds(w), "the plan is of another scene");
    if (!dem2di_load_good(loader)) return;
    size_t step = dem2di_step_cut(w, NULL, list->discs, list->pairs, list->count, &w->plan, false);
    dem2di_load_room(loader, dem2di_adjacency_reserve(w, list->pairs, list->count) &&
                                 dem2di_block_results_reserve(w, list->discs, list->count) &&
                                 dem2di_scratch_reserve(w, step));
    if (!dem2di_load_good(loader)) return;
    dem2di_adjacency_make(w);
    dem2di_loads_clear(w);
    w->immovable = dem2di_some_immovable(w);
}

static void dem2di_finish_world(dem2di_loader *loader) {
    dem2d_world *w = loader->world;
    dem2di_check_settings(loader);
    if (dem2di_load_good(loader)) dem2di_load_missing(loader, w, false);
    if (!dem2di_load_good(loader)) return;
    w->laws_side = w->material_count;
    for (int a = 0; a < w->material_count; a++)
        for (int b = 0; b < a; b++) *dem2di_law(w, b, a) = *dem2di_law(w, a, b);
    dem2di_load_room(loader, dem2di_reserve_bodies(w, w->body_count));
    for (int i = 0; i < w->body_count && w->loaded; i++)
        w->twisted = w->twisted || w->loads[i].torque != 0;
    if ((w->twisted || w->gather != NULL) && !w->plan.spin) w->plan_due = 2;
    dem2di_finish_shapes(loader);
    for (int i = 0; i < w->body_count && dem2di_load_good(loader); i++)
        dem2di_finish_body(loader, i);
    if (dem2di_load_good(loader)) dem2di_load_expect(loader, dem2di_ids_agree(w), "ids differ");
    if (dem2di_load_good(loader)) dem2di_finish_ranks(loader);
    dem2di_finish_walls(loader);
    dem2di_finish_list(loader);
}

/* Bytes of a snapshot, and where they come from. */
typedef struct dem2di_source {
    const dem2d_load_desc *desc;
    FILE *file; /* or NULL: desc->read */
    unsigned char *bytes;
    size_t size; /* so far */
} dem2di_source;

static dem2d_result dem2di_source_take(dem2di_source *source, unsigned char *bytes, size_t count) {
    const dem2d_load_desc *desc = source->desc;
    if (source->file == NULL) {
        if (desc->read(desc->user, (char *)bytes, count)) return DEM2D_OK;
        return dem2di_fail(desc->env, DEM2D_IO, -1, "could not read the snapshot");
    }
    if (fread(bytes, 1, count, source->file) == count) return DEM2D_OK;
    if (ferror(source->file)) return dem2di_fail(desc->env, DEM2D_IO, -1, "could not read");
    return dem2di_fail(desc->env, DEM2D_FORMAT, -1, "snapshot: cut short");
}

/* Memory grows with what has really come, whatever size the snapshot says it has. */
static dem2d_result dem2di_source_grow(dem2di_source *source, size_t size) {
    const dem2d_env *env = source->desc->env;
    size_t more = source->size < DEM2DI_CHUNK ? DEM2DI_CHUNK : source->size;
    if (more > size - source->size) more = size - source->size;
    size_t longer = source->size + more;
    unsigned char *bytes = (unsigned char *)dem2di_allocate(env, longer, 1);
    if (bytes == NULL)
        return dem2di_fail(env, DEM2D_OUT_OF_MEMORY, -1, "snapshot of %.0f bytes", (double)size);
    if (source->size > 0) memcpy(bytes, source->bytes, source->size);
    dem2d_result result = dem2di_source_take(source, bytes + source->size, more);
    dem2di_release(env, source->bytes, source->size, 1);
    source->bytes = bytes;
    source->size = longer;
    return result;
}

/* All bytes, found to be those that were written. */
static dem2d_result dem2di_source_read(dem2di_source *source) {
    const dem2d_load_desc *desc = source->desc;
    const dem2d_env *env = desc->env;
    unsigned char head[DEM2DI_SNAPSHOT_HEAD], beyond;
    dem2d_result result = dem2di_source_take(source, head, sizeof head);
    if (result != DEM2D_OK) return result;
    uint64_t version = dem2di_word_of(head + 8), size = dem2di_word_of(head + 16);
    if (dem2di_word_of(head) != DEM2DI_SNAPSHOT_MARK)
        return dem2di_fail(env, DEM2D_FORMAT, -1, "snapshot: does not begin as one");
    if (version != DEM2DI_SNAPSHOT_VERSION)
        return dem2di_fail(env, DEM2D_FORMAT_VERSION, -1, "snapshot of version %llu, not %u",
                           (unsigned long long)version, DEM2DI_SNAPSHOT_VERSION);
    size_t most = SIZE_MAX / 2, rest = (size_t)(size - DEM2DI_SNAPSHOT_HEAD);
    if (size < DEM2DI_SNAPSHOT_HEAD + DEM2DI_SNAPSHOT_TAIL || size > most || size % 8 != 0)
        return dem2di_fail(env, DEM2D_FORMAT, -1, "snapshot: size of %llu bytes",
                           (unsigned long long)size);
    while (source->size < rest && result == DEM2D_OK) result = dem2di_source_grow(source, rest);
    if (result != DEM2D_OK) return result;
    bool more = source->file != NULL ? fread(&beyond, 1, 1, source->file) == 1
                                     : desc->read(desc->user, (char *)&beyond, 1);
    if (more) return dem2di_fail(env, DEM2D_FORMAT, -1, "snapshot: bytes after its end");
    uint64_t checksum = DEM2DI_HASH_START;
    for (int k = 0; k < DEM2DI_SNAPSHOT_HEAD; k += 8)
        checksum = dem2di_hash_word(checksum, dem2di_word_of(head + k));
    rest -= DEM2DI_SNAPSHOT_TAIL;
    for (size_t k = 0; k < rest; k += 8)
        checksum = dem2di_hash_word(checksum, dem2di_word_of(source->bytes + k));
    if (checksum == dem2di_word_of(source->bytes + rest)) return DEM2D_OK;
    return dem2di_fail(env, DEM2D_FORMAT, -1, "snapshot: the checksum is another");
}

/* What a snapshot does not have is 0, not the default of a new world. */
static void dem2di_clear_settings(dem2d_world *world) {
    for (const dem2di_column *column = dem2di_columns; column->group == DEM2DI_WORLD; column++)
        for (int f = 0; f < column->count; f++)
            for (int k = 0; k < dem2di_numbers_of(&column->fields[f]); k++)
                dem2di_number_set(&column->fields[f], world, k, 0);
}

/* A world from bytes that have been read. */
static dem2d_result dem2di_source_load(const dem2di_source *source, dem2d_world **world) {
    const dem2d_load_desc *desc = source->desc;
    dem2di_loader loader;
    dem2d_world_desc empty;
    memset(&empty, 0, sizeof empty);
    empty.time_step = 1; /* until it is loaded */
    empty.env = desc->env;
    empty.parallel_for = desc->parallel_for;
    empty.parallel_user = desc->parallel_user;
    empty.gather = desc->gather;
    empty.commit = desc->commit;
    empty.exchange_user = desc->exchange_user;
    empty.loads = desc->loads;
    empty.loads_user = desc->loads_user;
    memset(&loader, 0, sizeof loader);
    dem2d_result result = dem2d_world_create(&empty, &loader.world);
    if (result != DEM2D_OK) return result;
    loader.desc = desc;
    loader.env = &loader.world->env;
    loader.next = source->bytes;
    loader.end = source->bytes + source->size - DEM2DI_SNAPSHOT_TAIL;
    dem2di_clear_settings(loader.world);
    while (loader.next < loader.end && dem2di_load_good(&loader)) dem2di_load_record(&loader);
    dem2di_finish_world(&loader);
    if (loader.result == DEM2D_OK)
        *world = loader.world;
    else
        dem2d_world_destroy(loader.world);
    return loader.result;
}

DEM2D_API dem2d_result dem2d_world_load(const dem2d_load_desc *desc, const char *path,
                                        dem2d_world **world) {
    dem2d_load_desc plain;
    memset(&plain, 0, sizeof plain);
    if (desc == NULL) desc = &plain;
    const dem2d_env *env = desc->env;
    if (world == NULL) return dem2di_fail_null(env, "world");
    if (path == NULL && desc->read == NULL) return dem2di_fail_null(env, "path and read");
    if (path != NULL && desc->read != NULL)
        return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1, "both path and read are given");
    dem2di_source source;
    memset(&source, 0, sizeof source);
    source.desc = desc;
    source.file = path != NULL ? fopen(path, "rb") : NULL;
    if (path != NULL && source.file == NULL)
        return dem2di_fail(env, DEM2D_IO, -1, "could not open %s", path);
    dem2d_result result = dem2di_source_read(&source);
    if (source.file != NULL) (void)fclose(source.file);
    if (result == DEM2D_OK) result = dem2di_source_load(&source, world);
    dem2di_release(env, source.bytes, source.size, 1);
    return result;
}

/* ============================================================================================
   >>writers  Pictures, files for ParaView, histories
   uses: config, math, memory, fields, mass, shapes, broad, law, world, objects, walls, measures,
   output
   ============================================================================================ */

/* Write text without formatting, of any length. */
static void dem2di_put(dem2di_writer *writer, const char *text) {
    dem2di_put_bytes(writer, text, strlen(text));
}

/* Write text with a point for each decimal sign of the locale. */
static void dem2di_put_points(dem2di_writer *writer, const char *text, int length) {
    int sign = writer->sign_length, begin = 0;
    for (int i = 0; sign > 0 && i + sign <= length; i++) {
        if (memcmp(text + i, writer->sign, (size_t)sign) != 0) continue;
        dem2di_put_bytes(writer, text + begin, (size_t)(i - begin));
        dem2di_put_bytes(writer, ".", 1);
        begin = i + sign;
        i = begin - 1;
    }
    dem2di_put_bytes(writer, text + begin, (size_t)(length - begin));
}

/* Write a short formatted text with numbers, the same in every locale. The locale's decimal sign
   may be a comma: literal commas have to go through dem2di_put. */
DEM2DI_PRINTF(2, 3)
static void dem2di_print(dem2di_writer *writer, const char *format, ...) {
    char text[512];
    if (!writer->good) return;
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (length < 0 || length >= (int)sizeof text) {
        writer->good = false;
        return;
    }
    dem2di_put_points(writer, text, length);
}

/* Write a number with all digits: reading it gives the same bits. */
static void dem2di_put_number(dem2di_writer *writer, double value) {
    dem2di_print(writer, "%.17g", value);
}

/* Number of points to draw a shape: the corners of a sharp polygon, else `points`, 0 for 64. */
static int dem2di_drawn_points(const dem2d_shape *shape, int points) {
    if (shape->type == DEM2D_POLYGON && shape->rounding == 0) return shape->count;
    return points == 0 ? 64 : points;
}

/* Extend the box to a half-plane beside it, if the distance is at most a third of its size: farther
   ones would make the rest of the picture small. */
static void dem2di_box_reach(const dem2d_world *world, int part, double size, dem2d_box *all) {
    const dem2di_surface surface = dem2di_surface_of(world, world->wall_before, part);
    dem2d_vec n = dem2di_surface_normal(&surface), nearest;
    nearest.x = n.x > 0 ? all->lower.x : all->upper.x;
    nearest.y = n.y > 0 ? all->lower.y : all->upper.y;
    double gap = dem2di_dot(n, dem2di_sub(nearest, surface.point));
    if (!(gap > 0 && gap <= size / 3)) return;
    dem2di_box_add(all, dem2di_along(nearest, -gap, n));
}

/* The bounding box of particles and segments and, if `beside`, of half-planes beside them, with a
   margin of a twentieth of the larger side; a unit square if there are none. */
static dem2d_box dem2di_scene_box(const dem2d_world *world, bool beside) {
    dem2d_box all = {{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}};
    for (int place = 0, slot; (slot = dem2di_next_particle(world, &place)) >= 0;) {
        dem2d_box box;
        dem2d_pose pose = dem2di_pose_of(world, world->before, slot);
        (void)dem2d_shape_aabb(dem2di_shape_of(world, &world->bodies[slot]), pose, &box);
        dem2di_box_add(&all, box.lower);
        dem2di_box_add(&all, box.upper);
    }
    for (int k = 0; k < world->part_count; k++) {
        const dem2di_surface surface = dem2di_surface_of(world, world->wall_before, k);
        if (!(world->parts[k].extent > 0)) continue;
        dem2di_box_add(&all, surface.point);
        dem2di_box_add(&all, dem2di_surface_end(&surface, world->parts[k].extent));
    }
    if (all.lower.x > all.upper.x) { /* none: a unit square */
        all.lower = dem2di_vec(0, 0);
        all.upper = dem2di_vec(1, 1);
    }
    dem2d_vec size = dem2di_sub(all.upper, all.lower);
    for (int k = 0; beside && k < world->part_count; k++)
        if (!(world->parts[k].extent > 0))
            dem2di_box_reach(world, k, dem2di_max(size.x, size.y), &all);
    size = dem2di_sub(all.upper, all.lower);
    double margin = dem2di_max(size.x, size.y) / 20;
    all.lower = dem2di_sub(all.lower, dem2di_vec(margin, margin));
    all.upper = dem2di_add(all.upper, dem2di_vec(margin, margin));
    return all;
}

/* Clip the range t[0] to t[1] of a line to where start + t rate is between low and high. */
static void dem2di_line_cut(double start, double rate, double low, double high, double t[2]) {
    if (rate == 0) {
        if (start < low || start > high) t[1] = t[0] - 1;
        return;
    }
    double a = (low - start) / rate, b = (high - start) / rate;
    t[0] = dem2di_max(t[0], dem2di_min(a, b));
    t[1] = dem2di_min(t[1], dem2di_max(a, b));
}

/* What of the line of a wall's part is inside a box. If the line misses the box: what is beside it,
   and false. */
static bool dem2di_part_line(const dem2d_world *world, int part, const dem2d_box *box,
                             dem2d_vec ends[2]) {
    const dem2di_surface surface = dem2di_surface_of(world, world->wall_before, part);
    if (world->parts[part].extent > 0) {
        ends[0] = surface.point;
        ends[1] = dem2di_surface_end(&surface, world->parts[part].extent);
        return true;
    }
    dem2d_vec along = dem2di_perp(dem2di_surface_normal(&surface));
    dem2d_vec size = dem2di_sub(box->upper, box->lower);
    dem2d_vec centre = dem2di_along(box->lower, 0.5, size);
    dem2d_vec foot = surface.point; /* of the centre */
    foot = dem2di_along(foot, dem2di_dot(dem2di_sub(centre, foot), along), along);
    double reach = (size.x * fabs(along.x) + size.y * fabs(along.y)) / 2;
    double cut[2] = {-reach, reach};
    dem2di_line_cut(foot.x, along.x, box->lower.x, box->upper.x, cut);
    dem2di_line_cut(foot.y, along.y, box->lower.y, box->upper.y, cut);
    bool inside = cut[0] <= cut[1];
    ends[0] = dem2di_along(foot, inside ? cut[0] : -reach, along);
    ends[1] = dem2di_along(foot, inside ? cut[1] : reach, along);
    return inside;
}

/* --- pictures -----------------------------------------------------------------------------------
 */

/* From world to picture coordinates: y down, pixels. */
typedef struct dem2di_view {
    dem2d_box box;
    double factor;        /* pixels per metre */
    double width, height; /* of the box */
    double strip;         /* height of the strip below it, for the scale bar */
} dem2di_view;

static dem2d_vec dem2di_pixel(const dem2di_view *view, dem2d_vec p) {
    return dem2di_vec((p.x - view->box.lower.x) * view->factor,
                      view->height - (p.y - view->box.lower.y) * view->factor);
}

static bool dem2di_box_given(const dem2d_box *box) {
    return box->lower.x != 0 || box->lower.y != 0 || box->upper.x != 0 || box->upper.y != 0;
}

static const dem2di_field dem2di_svg_fields[] = {
    DEM2DI_ROW(dem2d_svg_desc, width, DEM2DI_FROM_0, "px 800"),
    DEM2DI_ROW(dem2d_svg_desc, outline_points, DEM2DI_WHOLE_OR_0(3, DBL_MAX), "- 64"),
    DEM2DI_ROW(dem2d_svg_desc, force_chains, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_svg_desc, view.lower, DEM2DI_VECTOR, "m all"),
    DEM2DI_ROW(dem2d_svg_desc, view.upper, DEM2DI_VECTOR, "m all; above lower, or all zero"),
    DEM2DI_ROW(dem2d_svg_desc, write, DEM2DI_OPTIONAL, "- none; or a path, not both"),
    DEM2DI_ROW(dem2d_svg_desc, user, DEM2DI_OPTIONAL, "- NULL"),
};

static dem2d_result dem2di_check_view(const dem2d_env *env, const dem2d_box *view) {
    if (!dem2di_box_given(view)) return DEM2D_OK;
    if (view->upper.x > view->lower.x && view->upper.y > view->lower.y) return DEM2D_OK;
    return dem2di_fail(env, DEM2D_OUT_OF_RANGE, -1,
                       "view from (%g, %g) to (%g, %g): upper must be above lower", view->lower.x,
                       view->lower.y, view->upper.x, view->upper.y);
}

static dem2di_view dem2di_view_make(const dem2d_world *world, const dem2d_svg_desc *desc) {
    dem2di_view view;
    double width = desc->width == 0 ? 800 : desc->width;
    view.box = dem2di_box_given(&desc->view) ? desc->view : dem2di_scene_box(world, true);
    dem2d_vec size = dem2di_sub(view.box.upper, view.box.lower);
    view.factor = width / size.x;
    view.width = width;
    view.height = view.factor * size.y;
    view.strip = width / 16;
    return view;
}

/* Fill colour: by model, or by motion for particles that are not free. */
static const char *dem2di_fill_of(const dem2di_body *body, const dem2d_shape *shape) {
    static const char *const colour[] = {"#e8c468", "#8fb9d8", "#b9a3d6",
                                         "#94c99b", "#e59a83", "#c9c9c9"};
    if (body->motion == DEM2D_FIXED) return "#8c8c8c";
    return body->motion == DEM2D_DRIVEN ? "url(#dem2d-driven)" : colour[shape->type];
}

/* Is the bounding circle of a particle outside the view? */
static bool dem2di_off_view(const dem2d_world *world, const dem2di_view *view, int slot) {
    dem2d_vec c = world->before[slot].x;
    const dem2di_body *body = &world->bodies[slot];
    double r = dem2di_shape_of(world, body)->circumscribed * body->scale;
    return c.x + r < view->box.lower.x || c.x - r > view->box.upper.x ||
           c.y + r < view->box.lower.y || c.y - r > view->box.upper.y;
}

/* Draw one particle: a circle, or a path through its outline points. */
static void dem2di_draw_particle(const dem2d_world *world, const dem2di_view *view, int points,
                                 int i, dem2di_writer *writer) {
    const dem2d_shape *shape = dem2di_shape_of(world, &world->bodies[i]);
    const char *fill = dem2di_fill_of(&world->bodies[i], shape);
    dem2d_pose pose = dem2di_pose_of(world, world->before, i);
    if (shape->type == DEM2D_CIRCLE) {
        dem2d_vec c = dem2di_pixel(view, pose.position);
        dem2di_print(writer, "<circle cx=\"%.2f\" cy=\"%.2f\" r=\"%.2f\" fill=\"%s\"/>\n", c.x, c.y,
                     shape->a * pose.scale * view->factor, fill);
        return;
    }
    points = dem2di_drawn_points(shape, points);
    dem2di_print(writer, "<path d=\"");
    for (int k = 0; k < points; k++) {
        dem2d_vec p = dem2di_outline_point(shape, k, points);
        p = dem2di_pixel(view, dem2di_place(&pose, p));
        dem2di_print(writer, "%c%.2f %.2f", k == 0 ? 'M' : 'L', p.x, p.y);
    }
    dem2di_print(writer, "Z\" fill=\"%s\"/>\n", fill);
}

static void dem2di_draw_line(dem2d_vec p, dem2d_vec q, double width, dem2di_writer *writer) {
    dem2di_print(writer,
                 "<line x1=\"%.2f\" y1=\"%.2f\" x2=\"%.2f\" y2=\"%.2f\" "
                 "stroke-width=\"%.3f\"/>\n",
                 p.x, p.y, q.x, q.y, width);
}

static void dem2di_draw_walls(const dem2d_world *world, const dem2di_view *view,
                              dem2di_writer *writer) {
    dem2di_print(writer, "<g stroke=\"#444\">\n");
    for (int k = 0; k < world->part_count; k++) {
        dem2d_vec ends[2];
        if (dem2di_part_line(world, k, &view->box, ends))
            dem2di_draw_line(dem2di_pixel(view, ends[0]), dem2di_pixel(view, ends[1]),
                             view->width / 400, writer);
    }
    dem2di_print(writer, "</g>\n");
}

/* Force chains: lines from centre to centre, or to the contact point at a wall. The line of the
   mean force is as wide as a quarter of the mean radius, so that grains stay visible, or 1/400 of
   the picture if that is less. No line is wider than the radius of the smaller grain. */
static void dem2di_draw_chains(const dem2d_world *world, const dem2di_view *view,
                               dem2di_writer *writer) {
    double sum = 0, radii = 0;
    int open = 0;
    dem2di_contact_iterator iterator = dem2di_contacts_start(true);
    for (; dem2di_next_contact(world, &iterator); open++) {
        sum += iterator.contact.force;
        radii += dem2di_smaller_radius(world, &iterator) * view->factor;
    }
    double usual = open > 0 ? dem2di_min(view->width / 400, radii / open / 4) : 0;
    double unit = sum > 0 ? usual * open / sum : 0;
    dem2di_print(writer, "<g stroke=\"#7a0019\" stroke-opacity=\"0.75\" "
                         "stroke-linecap=\"round\">\n");
    iterator = dem2di_contacts_start(false);
    while (dem2di_next_contact(world, &iterator)) {
        const dem2di_key *key = &world->list.keys[iterator.number];
        dem2d_vec start = world->before[key->a].x, end = dem2di_add(start, iterator.branch);
        double most = dem2di_smaller_radius(world, &iterator) * view->factor;
        if (dem2di_off_view(world, view, key->a) &&
            (iterator.walls || dem2di_off_view(world, view, key->b)))
            continue;
        dem2di_draw_line(dem2di_pixel(view, start), dem2di_pixel(view, end),
                         dem2di_min(iterator.contact.force * unit, most), writer);
    }
    dem2di_print(writer, "</g>\n");
}

/* The greatest of 1, 2 and 5 times a power of ten that is not above a length; 0 if the length is
   not a normal number. */
static double dem2di_bar_length(double length) {
    double unit = 1;
    if (!(length >= DBL_MIN && length <= DBL_MAX)) return 0;
    while (unit > length) unit /= 10;
    while (unit * 10 <= length) unit *= 10;
    return unit * 5 <= length ? unit * 5 : unit * 2 <= length ? unit * 2 : unit;
}

/* Draw the scale bar below the scene: a line between two ticks, and its length. */
static void dem2di_draw_scale(const dem2di_view *view, dem2di_writer *writer) {
    double metres = dem2di_bar_length(0.3 * view->width / view->factor);
    double tick = view->strip / 8, y = view->height + view->strip / 2, line = view->width / 400;
    dem2d_vec left = dem2di_vec(view->width / 20, y);
    dem2d_vec right = dem2di_vec(left.x + metres * view->factor, y), up = dem2di_vec(0, tick);
    dem2di_print(writer, "<g stroke=\"#222\">\n");
    dem2di_draw_line(left, right, line, writer);
    dem2di_draw_line(dem2di_sub(left, up), dem2di_add(left, up), line, writer);
    dem2di_draw_line(dem2di_sub(right, up), dem2di_add(right, up), line, writer);
    dem2di_print(writer,
                 "</g>\n<text x=\"%.2f\" y=\"%.2f\" font-family=\"sans-serif\" "
                 "font-size=\"%.2f\" fill=\"#222\">%g m</text>\n",
                 right.x + 2 * tick, y + view->strip / 8, view->strip / 2.5, metres);
}

static void dem2di_draw(const dem2d_world *world, const dem2d_svg_desc *desc,
                        dem2di_writer *writer) {
    dem2di_view view = dem2di_view_make(world, desc);
    double height = view.height + view.strip;
    dem2di_print(writer,
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
                 "viewBox=\"0 0 %.2f %.2f\">\n<rect width=\"100%%\" height=\"100%%\" "
                 "fill=\"white\"/>\n",
                 view.width, height, view.width, height);
    dem2di_print(writer, /* hatching, a hundred lines across the picture */
                 "<defs><pattern id=\"dem2d-driven\" width=\"%.3f\" height=\"9\" "
                 "patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\">"
                 "<rect width=\"100%%\" height=\"9\" fill=\"#dcdcdc\"/>"
                 "<rect width=\"%.3f\" height=\"9\" fill=\"#6c6c6c\"/></pattern></defs>\n",
                 view.width / 100, view.width / 300);
    /* an inner picture clips all that is outside the view */
    dem2di_print(writer,
                 "<svg width=\"%.2f\" height=\"%.2f\">\n"
                 "<g stroke=\"#333\" stroke-width=\"%.3f\">\n",
                 view.width, view.height, view.width / 1600);
    for (int place = 0, slot; (slot = dem2di_next_particle(world, &place)) >= 0 && writer->good;)
        if (!dem2di_off_view(world, &view, slot))
            dem2di_draw_particle(world, &view, desc->outline_points, slot, writer);
    dem2di_print(writer, "</g>\n");
    dem2di_draw_walls(world, &view, writer);
    if (desc->force_chains) dem2di_draw_chains(world, &view, writer);
    dem2di_print(writer, "</svg>\n");
    dem2di_draw_scale(&view, writer);
    dem2di_print(writer, "</svg>\n");
}

DEM2D_API dem2d_result dem2d_world_write_svg(const dem2d_world *world, const dem2d_svg_desc *desc,
                                             const char *path) {
    dem2d_svg_desc plain;
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    memset(&plain, 0, sizeof plain);
    if (desc == NULL) desc = &plain;
    const dem2d_env *env = &world->env;
    dem2di_writer writer;
    dem2d_result result = dem2di_check_fields(env, DEM2DI_ALL(dem2di_svg_fields), desc);
    if (result == DEM2D_OK) result = dem2di_check_view(env, &desc->view);
    if (result == DEM2D_OK)
        result = dem2di_writer_open(env, desc->write, desc->user, path, false, &writer);
    if (result != DEM2D_OK) return result;
    dem2di_draw(world, desc, &writer);
    return dem2di_writer_close(env, path, &writer);
}

/* --- files for VTK ------------------------------------------------------------------------------
 */

/* An iterator over the items of a .vtp file (VTK's cells): particles, contacts or walls. */
typedef struct dem2di_item {
    dem2d_vtp_part part;
    int outline_points;
    dem2d_box box;                    /* of the scene, for walls */
    int index;                        /* the next particle or part of a wall */
    int slot;                         /* of the particle, or number of the part */
    dem2di_contact_iterator iterator; /* contacts of particles, then with walls */
} dem2di_item;

static dem2di_item dem2di_item_start(const dem2d_world *world, const dem2d_vtp_desc *desc) {
    dem2di_item item;
    memset(&item, 0, sizeof item);
    item.part = desc->part;
    item.outline_points = desc->outline_points;
    if (desc->part == DEM2D_VTP_WALLS) item.box = dem2di_scene_box(world, false);
    item.iterator = dem2di_contacts_start(false);
    return item;
}

static bool dem2di_item_next(const dem2d_world *world, dem2di_item *item) {
    if (item->part == DEM2D_VTP_PARTICLES) {
        item->slot = dem2di_next_particle(world, &item->index);
        return item->slot >= 0;
    }
    if (item->part == DEM2D_VTP_CONTACTS) return dem2di_next_contact(world, &item->iterator);
    item->slot = item->index++;
    return item->slot < world->part_count;
}

static int dem2di_item_points(const dem2d_world *world, const dem2di_item *item) {
    if (item->part != DEM2D_VTP_PARTICLES) return 2;
    return dem2di_drawn_points(dem2di_shape_of(world, &world->bodies[item->slot]),
                               item->outline_points);
}

/* An array of cell data: integers of 32 bits, or doubles. */
typedef struct dem2di_array {
    const char *name; /* NULL after the last */
    int components;
    bool whole;
} dem2di_array;

/* Greatest number of components of all arrays of a part. */
#define DEM2DI_ITEM_NUMBERS 21

static const dem2di_array *dem2di_arrays_of(dem2d_vtp_part part) {
    static const dem2di_array particles[] = {{"id", 1, true},
                                             {"type", 1, true},
                                             {"material", 1, true},
                                             {"motion", 1, true},
                                             {"contacts", 1, true},
                                             {"velocity", 3, false},
                                             {"angular_velocity", 1, false},
                                             {"angle", 1, false},
                                             {"mass", 1, false},
                                             {"radius", 1, false},
                                             {"stress", 9, false},
                                             {NULL, 0, false}};
    static const dem2di_array contacts[] = {{"a", 1, true},
                                            {"b", 1, true},
                                            {"wall", 1, true},
                                            {"points", 1, true},
                                            {"normal", 3, false},
                                            {"force", 3, false},
                                            {"position", 3, false},
                                            {"normal_force", 1, false},
                                            {"tangential_force", 1, false},
                                            {"moment", 1, false},
                                            {"depth", 1, false},
                                            {NULL, 0, false}};
    static const dem2di_array walls[] = {{"id", 1, true},        {"mode", 1, true},
                                         {"velocity", 3, false}, {"force", 3, false},
                                         {"stress", 1, false},   {NULL, 0, false}};
    return part == DEM2D_VTP_PARTICLES ? particles : part == DEM2D_VTP_CONTACTS ? contacts : walls;
}

static void dem2di_particle_numbers(const dem2d_world *world, int slot, double *numbers) {
    const dem2di_body *body = &world->bodies[slot];
    dem2di_velocities mean = dem2di_velocities_mean(world, slot);
    dem2d_stress stress = dem2di_particle_stress(world, slot);
    const double all[] = {(double)body->index,
                          (double)dem2di_shape_of(world, body)->type,
                          (double)body->material,
                          (double)body->motion,
                          (double)dem2di_contacts_of(world, slot),
                          mean.v.x,
                          mean.v.y,
                          0,
                          mean.w,
                          dem2d_rot_angle(dem2di_pose_of(world, world->before, slot).rotation),
                          dem2di_body_mass(world, body),
                          dem2di_equivalent(world, slot),
                          stress.xx,
                          stress.xy,
                          0,
                          stress.yx,
                          stress.yy,
                          0,
                          0,
                          0,
                          0};
    memcpy(numbers, all, sizeof all);
}

static void dem2di_contact_numbers(const dem2d_world *world,
                                   const dem2di_contact_iterator *iterator, double *numbers) {
    dem2d_contact_info info = dem2di_contact_of(world, iterator);
    dem2d_vec force = dem2di_contact_force(&iterator->contact);
    const double all[] = {(double)info.a.index,
                          iterator->walls ? -1 : (double)info.b.index,
                          iterator->walls ? (double)info.wall.index : -1,
                          (double)info.points,
                          info.normal.x,
                          info.normal.y,
                          0,
                          force.x,
                          force.y,
                          0,
                          info.point.x,
                          info.point.y,
                          0,
                          info.normal_force,
                          info.tangential_force,
                          info.moment,
                          info.depth};
    memcpy(numbers, all, sizeof all);
}

static void dem2di_wall_numbers(const dem2d_world *world, int part, double *numbers) {
    int j = world->parts[part].wall;
    dem2d_wall_info info;
    (void)dem2d_world_get_wall(world, dem2di_wall_id(world, j), &info);
    dem2d_vec v = dem2di_add(world->wall_before[j].velocity, world->wall_now[j].velocity);
    const double all[] = {(double)j,    (double)info.mode, v.x / 2, v.y / 2,    0,
                          info.force.x, info.force.y,      0,       info.stress};
    memcpy(numbers, all, sizeof all);
}

static void dem2di_item_numbers(const dem2d_world *world, const dem2di_item *item,
                                double numbers[DEM2DI_ITEM_NUMBERS]) {
    if (item->part == DEM2D_VTP_PARTICLES)
        dem2di_particle_numbers(world, item->slot, numbers);
    else if (item->part == DEM2D_VTP_CONTACTS)
        dem2di_contact_numbers(world, &item->iterator, numbers);
    else
        dem2di_wall_numbers(world, item->slot, numbers);
}

/* Write the doubles of one item or point. Subnormal numbers become 0: some readers reject them. */
static void dem2di_vtp_doubles(dem2di_writer *writer, const double *numbers, int count) {
    for (int k = 0; k < count; k++) {
        if (k > 0) dem2di_put(writer, " ");
        dem2di_put_number(writer, fabs(numbers[k]) >= DBL_MIN ? numbers[k] : 0);
    }
    dem2di_put(writer, "\n");
}

static void dem2di_vtp_point(dem2di_writer *writer, dem2d_vec p) {
    const double numbers[3] = {p.x, p.y, 0};
    dem2di_vtp_doubles(writer, numbers, 3);
}

static void dem2di_item_put_points(const dem2d_world *world, const dem2di_item *item,
                                   dem2di_writer *writer) {
    dem2d_vec ends[2];
    if (item->part == DEM2D_VTP_PARTICLES) {
        const dem2d_shape *shape = dem2di_shape_of(world, &world->bodies[item->slot]);
        dem2d_pose pose = dem2di_pose_of(world, world->before, item->slot);
        int points = dem2di_item_points(world, item);
        for (int i = 0; i < points; i++)
            dem2di_vtp_point(writer, dem2di_place(&pose, dem2di_outline_point(shape, i, points)));
        return;
    }
    if (item->part == DEM2D_VTP_CONTACTS) {
        ends[0] = world->before[world->list.keys[item->iterator.number].a].x;
        ends[1] = dem2di_add(ends[0], item->iterator.branch);
    } else {
        (void)dem2di_part_line(world, item->slot, &item->box, ends);
    }
    for (int i = 0; i < 2; i++) dem2di_vtp_point(writer, ends[i]);
}

static void dem2di_vtp_tag(dem2di_writer *writer, const char *type, const char *name,
                           int components) {
    dem2di_print(writer,
                 "<DataArray type=\"%s\" Name=\"%s\" NumberOfComponents=\"%d\" "
                 "format=\"ascii\">\n",
                 type, name, components);
}

static void dem2di_vtp_cell_data(const dem2d_world *world, const dem2d_vtp_desc *desc,
                                 dem2di_writer *writer) {
    double numbers[DEM2DI_ITEM_NUMBERS];
    int first = 0; /* of the array's among the numbers of an item */
    dem2di_put(writer, "<CellData>\n");
    for (const dem2di_array *array = dem2di_arrays_of(desc->part); array->name != NULL; array++) {
        dem2di_item item = dem2di_item_start(world, desc);
        dem2di_vtp_tag(writer, array->whole ? "Int32" : "Float64", array->name, array->components);
        while (dem2di_item_next(world, &item)) {
            dem2di_item_numbers(world, &item, numbers);
            if (array->whole)
                dem2di_print(writer, "%d\n", (int)numbers[first]);
            else
                dem2di_vtp_doubles(writer, numbers + first, array->components);
        }
        dem2di_put(writer, "</DataArray>\n");
        first += array->components;
    }
    dem2di_put(writer, "</CellData>\n");
}

/* Write the points of all items, and the cells that connect the points of each. */
static void dem2di_vtp_cells(const dem2d_world *world, const dem2d_vtp_desc *desc, int64_t points,
                             dem2di_writer *writer) {
    const char *kind = desc->part == DEM2D_VTP_PARTICLES ? "Polys" : "Lines";
    dem2di_item item = dem2di_item_start(world, desc);
    int64_t end = 0;
    dem2di_put(writer, "<Points>\n");
    dem2di_vtp_tag(writer, "Float64", "Points", 3);
    while (dem2di_item_next(world, &item)) dem2di_item_put_points(world, &item, writer);
    dem2di_print(writer, "</DataArray>\n</Points>\n<%s>\n", kind);
    dem2di_vtp_tag(writer, "Int64", "connectivity", 1);
    for (int64_t i = 0; i < points; i++) dem2di_print(writer, "%lld\n", (long long)i);
    dem2di_put(writer, "</DataArray>\n");
    dem2di_vtp_tag(writer, "Int64", "offsets", 1);
    for (item = dem2di_item_start(world, desc); dem2di_item_next(world, &item);) {
        end += dem2di_item_points(world, &item);
        dem2di_print(writer, "%lld\n", (long long)end);
    }
    dem2di_print(writer, "</DataArray>\n</%s>\n", kind);
}

static void dem2di_vtp(const dem2d_world *world, const dem2d_vtp_desc *desc,
                       dem2di_writer *writer) {
    dem2di_item item = dem2di_item_start(world, desc);
    int cells = 0;
    int64_t points = 0;
    for (; dem2di_item_next(world, &item); cells++) points += dem2di_item_points(world, &item);
    bool lines = desc->part != DEM2D_VTP_PARTICLES;
    dem2di_put(writer, "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
                       "byte_order=\"LittleEndian\">\n<PolyData>\n");
    dem2di_print(writer,
                 "<Piece NumberOfPoints=\"%lld\" NumberOfVerts=\"0\" NumberOfLines=\"%d\" "
                 "NumberOfStrips=\"0\" NumberOfPolys=\"%d\">\n",
                 (long long)points, lines ? cells : 0, lines ? 0 : cells);
    dem2di_vtp_cell_data(world, desc, writer);
    dem2di_vtp_cells(world, desc, points, writer);
    dem2di_put(writer, "</Piece>\n</PolyData>\n</VTKFile>\n");
}

static const dem2di_field dem2di_vtp_fields[] = {
    DEM2DI_ROW(dem2d_vtp_desc, outline_points, DEM2DI_WHOLE_OR_0(3, DBL_MAX), "- 64"),
    DEM2DI_ROW(dem2d_vtp_desc, part, DEM2DI_CHOICE(DEM2D_VTP_PART_COUNT), "- PARTICLES"),
    DEM2DI_ROW(dem2d_vtp_desc, write, DEM2DI_OPTIONAL, "- none; or a path, not both"),
    DEM2DI_ROW(dem2d_vtp_desc, user, DEM2DI_OPTIONAL, "- NULL"),
};

DEM2D_API dem2d_result dem2d_world_write_vtp(const dem2d_world *world, const dem2d_vtp_desc *desc,
                                             const char *path) {
    dem2d_vtp_desc plain;
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    memset(&plain, 0, sizeof plain);
    if (desc == NULL) desc = &plain;
    const dem2d_env *env = &world->env;
    dem2di_writer writer;
    dem2d_result result = dem2di_check_fields(env, DEM2DI_ALL(dem2di_vtp_fields), desc);
    if (result == DEM2D_OK)
        result = dem2di_writer_open(env, desc->write, desc->user, path, false, &writer);
    if (result != DEM2D_OK) return result;
    dem2di_vtp(world, desc, &writer);
    return dem2di_writer_close(env, path, &writer);
}

/* Write text as the value of an attribute. */
static void dem2di_put_escaped(dem2di_writer *writer, const char *text) {
    while (*text != '\0') {
        size_t plain = strcspn(text, "&<>\"'");
        dem2di_put_bytes(writer, text, plain);
        text += plain;
        if (*text == '\0') return;
        dem2di_put(writer, *text == '&'   ? "&amp;"
                           : *text == '<' ? "&lt;"
                           : *text == '>' ? "&gt;"
                           : *text == '"' ? "&quot;"
                                          : "&apos;");
        text++;
    }
}

/* Check the caller's names and values: not NULL, values finite, names without unwanted bytes. */
static dem2d_result dem2di_check_named(const dem2d_env *env, const char *const *names,
                                       const char *what, const double *values, const char *of,
                                       int count, const char *unwanted) {
    if (count == 0) return DEM2D_OK;
    if (names == NULL) return dem2di_fail_null(env, what);
    if (values == NULL) return dem2di_fail_null(env, of);
    for (int i = 0; i < count; i++) {
        if (names[i] == NULL)
            return dem2di_fail(env, DEM2D_NULL_ARGUMENT, i, "%s[%d] is NULL", what, i);
        if (names[i][strcspn(names[i], unwanted)] != '\0')
            return dem2di_fail(env, DEM2D_OUT_OF_RANGE, i, "%s[%d] = %s", what, i, names[i]);
        if (!dem2di_finite(values[i]))
            return dem2di_fail(env, DEM2D_NOT_FINITE, i, "%s[%d] = %g is not finite", of, i,
                               values[i]);
    }
    return DEM2D_OK;
}

/* Control characters, which XML does not allow. */
#define DEM2DI_CONTROL                                                 \
    "\001\002\003\004\005\006\007\010\011\012\013\014\015\016\017\020" \
    "\021\022\023\024\025\026\027\030\031\032\033\034\035\036\037"

static const dem2di_field dem2di_pvd_fields[] = {
    DEM2DI_ROW(dem2d_pvd_desc, count, DEM2DI_WHOLE(0, 1 << 30), "- 0"),
    DEM2DI_ROW(dem2d_pvd_desc, times, DEM2DI_OPTIONAL, "s none; count values, finite"),
    DEM2DI_ROW(dem2d_pvd_desc, files, DEM2DI_OPTIONAL, "- none; count names, no control bytes"),
    DEM2DI_ROW(dem2d_pvd_desc, write, DEM2DI_OPTIONAL, "- none; or a path, not both"),
    DEM2DI_ROW(dem2d_pvd_desc, user, DEM2DI_OPTIONAL, "- NULL"),
};

DEM2D_API dem2d_result dem2d_pvd_write(const dem2d_env *env, const dem2d_pvd_desc *desc,
                                       const char *path) {
    dem2di_writer writer;
    if (desc == NULL) return dem2di_fail_null(env, "desc");
    dem2d_result result = dem2di_check_fields(env, DEM2DI_ALL(dem2di_pvd_fields), desc);
    if (result == DEM2D_OK)
        result = dem2di_check_named(env, desc->files, "files", desc->times, "times", desc->count,
                                    DEM2DI_CONTROL);
    if (result == DEM2D_OK)
        result = dem2di_writer_open(env, desc->write, desc->user, path, false, &writer);
    if (result != DEM2D_OK) return result;
    dem2di_put(&writer, "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" "
                        "byte_order=\"LittleEndian\">\n<Collection>\n");
    for (int i = 0; i < desc->count; i++) {
        dem2di_put(&writer, "<DataSet timestep=\"");
        dem2di_put_number(&writer, desc->times[i]);
        dem2di_put(&writer, "\" group=\"\" part=\"0\" file=\"");
        dem2di_put_escaped(&writer, desc->files[i]);
        dem2di_put(&writer, "\"/>\n");
    }
    dem2di_put(&writer, "</Collection>\n</VTKFile>\n");
    return dem2di_writer_close(env, path, &writer);
}

/* --- histories ----------------------------------------------------------------------------------
 */

/* A column of a history. */
typedef struct dem2di_csv_column {
    const char *name;
    double value;
} dem2di_csv_column;

/* Room for the columns of a world: 18, and 11 of its ledger. */
#define DEM2DI_CSV_COLUMNS 30

/* The columns of a world, with those of its ledger if it keeps one. Returns their number. */
static int dem2di_csv_columns(const dem2d_world *world,
                              dem2di_csv_column columns[DEM2DI_CSV_COLUMNS]) {
    dem2d_energy energy;
    dem2d_equilibrium rest;
    dem2d_packing packing;
    dem2d_stats stats;
    dem2d_ledger l;
    (void)dem2d_world_energy(world, &energy);
    (void)dem2d_world_equilibrium(world, &rest);
    (void)dem2d_world_packing(world, &packing);
    (void)dem2d_world_stats(world, &stats);
    memset(&l, 0, sizeof l);
    if (world->ledger.kept) (void)dem2d_world_ledger(world, &l);
    const dem2di_csv_column all[DEM2DI_CSV_COLUMNS] = {
        {"step", (double)stats.steps},
        {"time", stats.time},
        {"translational", energy.translational},
        {"rotational", energy.rotational},
        {"normal", energy.normal},
        {"tangential", energy.tangential},
        {"rolling", energy.rolling},
        {"potential", energy.potential},
        {"kinetic_ratio", rest.kinetic_ratio},
        {"mean_speed", rest.mean_speed},
        {"max_speed", rest.max_speed},
        {"unbalanced", rest.unbalanced},
        {"coordination", packing.coordination},
        {"coordination_loaded", packing.coordination_loaded},
        {"rattlers", (double)packing.rattlers},
        {"contacts", (double)stats.contacts},
        {"wall_contacts", (double)stats.wall_contacts},
        {"max_overlap", packing.max_overlap},
        {"ledger_kinetic", l.kinetic},
        {"ledger_normal", l.normal},
        {"ledger_tangential", l.tangential},
        {"ledger_gravity", l.gravity},
        {"ledger_walls", l.walls},
        {"ledger_driven", l.driven},
        {"ledger_loads", l.loads},
        {"ledger_friction", l.friction},
        {"ledger_dashpot", l.dashpot},
        {"ledger_damping", l.damping},
        {"ledger_given", l.given},
        {"ledger_closure", l.closure},
    };
    memcpy(columns, all, sizeof all);
    return world->ledger.kept ? DEM2DI_CSV_COLUMNS : 18;
}

/* A header line if this is the first row, then the row. */
static void dem2di_csv_rows(const dem2d_world *world, const dem2d_csv_desc *desc,
                            dem2di_writer *writer) {
    dem2di_csv_column columns[DEM2DI_CSV_COLUMNS];
    int own = dem2di_csv_columns(world, columns);
    for (int row = desc->append ? 1 : 0; row < 2; row++) {
        for (int i = 0; i < own + desc->count; i++) {
            const char *name = i < own ? columns[i].name : desc->names[i - own];
            if (i > 0) dem2di_put(writer, ",");
            if (row == 0)
                dem2di_put(writer, name);
            else
                dem2di_put_number(writer, i < own ? columns[i].value : desc->values[i - own]);
        }
        dem2di_put(writer, "\n");
    }
}

static const dem2di_field dem2di_csv_fields[] = {
    DEM2DI_ROW(dem2d_csv_desc, count, DEM2DI_WHOLE(0, 1 << 30), "- 0"),
    DEM2DI_ROW(dem2d_csv_desc, names, DEM2DI_OPTIONAL, "- none; count; no comma, quote, line end"),
    DEM2DI_ROW(dem2d_csv_desc, values, DEM2DI_OPTIONAL, "- none; count values, finite"),
    DEM2DI_ROW(dem2d_csv_desc, append, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_csv_desc, write, DEM2DI_OPTIONAL, "- none; or a path, not both"),
    DEM2DI_ROW(dem2d_csv_desc, user, DEM2DI_OPTIONAL, "- NULL"),
};

DEM2D_API dem2d_result dem2d_world_write_csv(const dem2d_world *world, const dem2d_csv_desc *desc,
                                             const char *path) {
    dem2d_csv_desc plain;
    if (world == NULL) return DEM2D_NULL_ARGUMENT;
    memset(&plain, 0, sizeof plain);
    if (desc == NULL) desc = &plain;
    const dem2d_env *env = &world->env;
    dem2di_writer writer;
    dem2d_result result = dem2di_check_fields(env, DEM2DI_ALL(dem2di_csv_fields), desc);
    if (result == DEM2D_OK)
        result = dem2di_check_named(env, desc->names, "names", desc->values, "values", desc->count,
                                    ",\"\r\n");
    if (result == DEM2D_OK)
        result = dem2di_writer_open(env, desc->write, desc->user, path, desc->append, &writer);
    if (result != DEM2D_OK) return result;
    dem2di_csv_rows(world, desc, &writer);
    return dem2di_writer_close(env, path, &writer);
}

#ifdef __cplusplus
}
#endif

#if defined(__clang__)
#pragma STDC FP_CONTRACT DEFAULT
#elif defined(__GNUC__)
#pragma GCC pop_options
#endif

#endif /* DEM2D_IMPLEMENTATION_ONCE */
#endif /* DEM2D_IMPLEMENTATION */

/* ============================================================================================
   >>licence  Changes and licence

   CHANGES
     0.7.0  Snapshots stay of version 4: those of 0.6.0 are read, unless they have dashpots, rolling
            friction or a law: these are refused by the names of their arrays.
            Circles with dashpots and rolling friction are nearly as fast as those without. A step
            that would give circles a state that is not finite is refused.
            A tangential spring of one contact point is shared out to two by the forces of their
            normal springs, without dashpots.
            External loads: dem2d_world_set_load, or dem2d_world_desc.loads once a step; their work
            is dem2d_ledger.loads and a column of histories.
            Several processes: dem2d_world_desc.gather may change the sums of the contact forces in
            each step, commit may refuse a step.
            Units, ranges and defaults of options are said once, in the comments of the descs.
            Particles and walls may have a name of 64 bits, which orders pairs and sums in place of
            the id (name in their descs and infos).
            Polygons in contact at one point take a third less time, smooth grains a tenth.
            New: queries of space (dem2d_world_query_box, _query_point, _query_shape, _cast_ray,
            _cast_ray_all, _nearest), and dem2d_world_particle_contacts.
            New: dem2d_pairs_contact, many contact queries at once, with a memory that the caller
            keeps.
     0.6.0  Runs differ from those of 0.5.0 with friction between circles, dashpots, polybeziers,
            two contact points with friction, and servo walls. Snapshots (version 4) name their
            arrays and fields, so that later headers read them; earlier snapshots are refused. The
            state hash uses the same tables, and has other values.
            Papers: the manual lists the differences from each of their equations and steps. With
            DEM2D_GJK_EPA a world collides every pair, circles too, in every step from the line of
            centres; DEM2D_ONE_POINT takes the middle at walls, too. New: dem2d_contact.residual of
            EPA, the settings of the swarm in dem2d_fit_desc, DEM2D_HISTOGRAM_ALONG_BRANCH.
            Polybeziers: correct results for arcs that turn by pi, for straight, nearly straight and
            tiny arcs, and for joints that are smooth only to seven digits;
            dem2d_shape_info.deviation is the size of the repair. Witness points are on the outline
            to 1e-10 of the size; where arcs are not exactly convex, on its hull. Fits bound the
            radius of curvature by 20 times the size (max_radius, unbounded) and use straight arcs
            along straight edges; shapes and reports have the greatest radius. The bounds of the
            time step include the rocking stiffness of flat surfaces.
            Contacts: each of two points keeps its spring at its corner, whichever grain has the
            lower id (dem2d_contact_point.corner). Polygons cut by a longer segment along one of
            their edges are found. Two points on straight arcs conserve energy where one arc
            replaces another. DEM2D_CONTACT_AREA is removed: two points conserve energy at a
            hundredth of its cost.
            Sliding: for all pairs the mean over the last step, independent of later changes of time
            step and velocities. The ledger closes with dashpots at two points and where contacts
            open, and has the turnover.
            Servo walls use the dashpots of their contacts and the next step of the particles: they
            hold their stress for every damping ratio, and facing servo walls come to rest.
            Worlds: every saved snapshot can be loaded, also if joints of segments have changed
            since the list was built. Joints of segments are found in every step. A refused step
            changes no moment of a contact, and a servo wall never gets a speed that is not finite.
            Circles have contacts only after a force pass; if a law without tangential spring
            replaces one with it, the tangential force becomes 0. dem2d_stats.time is the sum of the
            time steps.
            Results and hashes do not depend on the neighbour list, its skin or the order in memory,
            for any shape. The time step is checked in the first step, after edits that can matter
            and in every 160th step. Edits no longer rebuild the list, unless they list other pairs.
            A wall that is set again keeps the history of its contacts, unless it turns by a right
            angle or more. Pairs that no force can move against each other (fixed, driven, walls
            without servo control) are no contacts.
            Pictures and outlines: two bytes per pixel, label masks, a region of interest,
            thresholds without frames, grains inside frames. Outlines that cross themselves are
            refused (DEM2D_CROSSING). The long axis of a template is exact for every model.
            Writers: an SVG picture has a view, shows half-planes beside the grains, marks fixed and
            driven grains, and draws no chain wider than the grains. Numbers have a decimal point in
            every locale. desc may be NULL where all of it may be zero.
            Errors of descs tell the field, its value and its range. dem2d_shape_create_bezier
            returns OUT_OF_RANGE for too many arcs.
            Names: dem2d_stats.looks -> collisions, gaps -> separations; dem2d_law_input.closing ->
            approach, slip -> sliding, turning -> spin.
            Contacts are stored: queries read what the last force pass wrote. After
            dem2d_world_set_pair energies and bounds of the time step use the new properties at
            once. dem2d_contact_info has part_a, part_b, shift, feature and sign.
            Log and compilers: warnings have the result DEM2D_WARNING. The header does not compile
            with parts of -ffast-math for which the compiler defines a macro. After the
            implementation clang uses the contraction of its command line again, on every target.
     0.5.0  The two points of faces conserve energy between free polygons as well: each has a
            normal of its own and tells its energy. Snapshots of version 2.
     0.4.0  Dashpots by restitution, rolling friction, a caller's law, segment walls. Measures of
            fabric, anisotropy, orientation, stress of particles, porosity of a region (no longer of
            an area), rest; the ledger of energies. VTK files and CSV histories, scale bars.
            Snapshots and the state hash.
     0.3.0  Steps laid out for speed: contacts by kind, circles by vector instructions, sums by
            particle, particles sorted in space; skins tuned to the motion; what a scene does not
            use is not paid for. parallel_for shares a step out to threads, to the same bits. Two
            polygons try the edge and corner of the last step first.
     0.2.0  Certified contacts by Newton's steps on the support value; GJK and EPA selectable. Two
            contact points where faces meet, or the contact-area rule. Separated pairs are left
            alone while their gap lasts. The contact point of a wall is on the wall.
     0.1.0  First version: five shape models and custom ones, outlines from pictures, fits, GJK
            and EPA, world, measures, SVG.

   LICENCE (MIT)
     Copyright (c) 2026 dem2d contributors

     Permission is hereby granted, free of charge, to any person obtaining a copy
     of this software and associated documentation files (the "Software"), to deal
     in the Software without restriction, including without limitation the rights
     to use, copy, modify, merge, publish, distribute, sublicense, and/or sell
     copies of the Software, and to permit persons to whom the Software is
     furnished to do so, subject to the following conditions:

     The above copyright notice and this permission notice shall be included in all
     copies or substantial portions of the Software.

     THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
     IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
     FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
     AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
     LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
     OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
     SOFTWARE.
   ============================================================================================ */
