/* inside.h - what tests see and do inside of a world and of the writers. Include it after dem2d.h;
   it is defined where the implementation is. */
#ifndef INSIDE_H
#define INSIDE_H

/* Where the particle of an index is stored. */
int inside_slot(const dem2d_world *world, int index);
/* Sort the particles in space with the next list, or do not. */
void inside_scatter(dem2d_world *world, bool scattered);
/* In the next step, have contacts computed one by one, and none in tiles. */
void inside_take_singly(dem2d_world *world);
/* Renew the list of pairs in the next step. */
void inside_renew_list(dem2d_world *world);
/* Has a particle moved as far as its skin; will the next step renew the list? */
bool inside_list_used_up(const dem2d_world *world);
bool inside_list_stale(const dem2d_world *world);
/* Sort the particles in space now; list the pairs now. */
bool inside_arrange(dem2d_world *world);
bool inside_build_list(dem2d_world *world);
/* The material whose law alone the steps of a world with pairs of circles go by, or -1. */
int inside_one_law(const dem2d_world *world);
/* Make as if so many steps had been too slow, and so many contacts not finite. */
void inside_count_failures(dem2d_world *world, int slow, int unsound);
/* Of a world without inverse skins and global damping, and of whole, which has them: give them to
   the first, and forget the count of the last kind of proof. False if it has them already. */
bool inside_give_back(dem2d_world *whole, dem2d_world *part);
/* The drift of a servo wall, and the position of the particle in a slot, by the last step. */
double inside_wall_drift(const dem2d_world *world, int wall);
dem2d_vec inside_position(const dem2d_world *world, int slot);
/* Pairs of particles that the last force pass did not list, or took for apart, though they overlap
   at its positions by more than 1e-7 of the size. */
int inside_count_missed(const dem2d_world *world);
/* Of a particle in a slot and a wall of one part: radius and both skins; how often they are listed.
   Listed contacts with walls. */
double inside_reach(const dem2d_world *world, int slot, int wall);
int inside_count_listed(const dem2d_world *world, int slot, int wall);
int inside_wall_contacts(const dem2d_world *world);
/* Do steps pass over a wall, because it rests without a contact; end that. */
bool inside_wall_is_quiet(const dem2d_world *world, int wall);
void inside_wake_wall(dem2d_world *world, int wall);
/* Tables of columns and fields: names that are one of a kind and fit into a record, no more fields
   than there are bits; a column is swapped with one of its kind. */
bool inside_tables_hold(void);
/* Is the column of this name one of settings; one of shapes? */
bool inside_is_setting(const char *column);
bool inside_is_of_shapes(const char *column);
/* Bytes that a writer passes on at once. */
size_t inside_chunk(void);
/* Circles by vectors of four, where the machine has them, or in plain C99. */
void inside_choose_fours(dem2d_world *world, bool fours);
/* Force pass and motion one after the other, or in turns where nothing hinders that. */
void inside_choose_two_passes(dem2d_world *world, bool in_two);
/* Do the invariants at the head of the world's section hold? Prints the first that does not. */
bool inside_holds(const dem2d_world *world);
/* Write to a file that is open for reading only; the result of closing it. */
dem2d_result inside_write_in_vain(const char *path, bool *good);

#ifdef DEM2D_IMPLEMENTATION

int inside_slot(const dem2d_world *world, int index) {
    return world->ids[index].slot;
}

void inside_scatter(dem2d_world *world, bool scattered) {
    world->scattered = scattered;
}

void inside_take_singly(dem2d_world *world) {
    world->immovable = true; /* that some pair is: each is then asked for it */
}

void inside_renew_list(dem2d_world *world) {
    world->list_stale = true;
}

bool inside_list_used_up(const dem2d_world *world) {
    return world->list_used_up;
}

bool inside_list_stale(const dem2d_world *world) {
    return world->list_stale;
}

bool inside_arrange(dem2d_world *world) {
    world->scattered = world->list_stale = true;
    return dem2di_arrange(world);
}

bool inside_build_list(dem2d_world *world) {
    const dem2di_plan plan = dem2di_plan_make(world);
    return dem2di_build_list(world, &plan) == DEM2D_OK;
}

int inside_one_law(const dem2d_world *world) {
    return world->plan.one_law && world->list.discs > 0 ? world->plan.material : -1;
}

void inside_count_failures(dem2d_world *world, int slow, int unsound) {
    world->slow_time_step = slow, world->count.unsound = unsound;
}

bool inside_give_back(dem2d_world *whole, dem2d_world *part) {
    bool good = part->global_damping == 0 && whole->global_damping != 0 && whole->skin > 0;
    for (int i = 0; i < part->body_count; i++) {
        good = good && part->inverse_skin_squared[i] == 0 && whole->inverse_skin_squared[i] != 0;
        part->inverse_skin_squared[i] = whole->inverse_skin_squared[i];
    }
    part->global_damping = whole->global_damping;
    whole->count.proofs[DEM2D_PROOF_COUNT - 1] = 0;
    return good;
}

double inside_wall_drift(const dem2d_world *world, int wall) {
    return world->wall_now[wall].drift;
}

dem2d_vec inside_position(const dem2d_world *world, int slot) {
    return world->now[slot].x;
}

/* Overlap of two particles at the positions of the last force pass; 0: none. */
static double inside_depth(const dem2d_world *w, int a, int b) {
    dem2d_contact contact;
    const dem2d_result result = dem2d_pair_contact(
        dem2di_shape_of(w, &w->bodies[a]), dem2di_pose_of(w, w->before, a),
        dem2di_shape_of(w, &w->bodies[b]), dem2di_pose_of(w, w->before, b), NULL, &contact);
    if (result != DEM2D_OK) return HUGE_VAL;
    return contact.state == DEM2D_PENETRATING ? contact.depth : 0;
}

int inside_count_missed(const dem2d_world *world) {
    int missed = 0;
    for (int a = 0; a < world->body_count; a++)
        for (int b = 0; b < a; b++) {
            const double size = dem2di_shape_of(world, &world->bodies[a])->circumscribed;
            if (inside_depth(world, a, b) <= 1e-7 * size) continue;
            dem2di_key key = {b, a};
            if (world->bodies[a].index < world->bodies[b].index) key.a = a, key.b = b;
            const int listed = dem2di_listed(&world->list, &key, false);
            missed += listed < 0 || (!dem2di_immovable(world, listed) &&
                                     !(world->list.contacts.depth[listed] > 0));
        }
    return missed;
}

double inside_reach(const dem2d_world *world, int slot, int wall) {
    return world->now[slot].radius + 1 / sqrt(world->inverse_skin_squared[slot]) +
           world->walls[wall].skin;
}

int inside_count_listed(const dem2d_world *world, int slot, int wall) {
    const dem2di_list *list = &world->list;
    int listed = 0;
    for (int k = list->first[slot]; k < list->first[slot + 1]; k++)
        listed += list->adjacent[k] >= list->pairs &&
                  list->keys[list->adjacent[k]].b == world->walls[wall].first;
    return listed;
}

int inside_wall_contacts(const dem2d_world *world) {
    return world->list.count - world->list.pairs;
}

bool inside_wall_is_quiet(const dem2d_world *world, int wall) {
    return world->walls[wall].quiet;
}

void inside_wake_wall(dem2d_world *world, int wall) {
    world->walls[wall].quiet = false;
}

void inside_choose_fours(dem2d_world *world, bool fours) {
    world->fours = fours && dem2di_has_fours();
}

void inside_choose_two_passes(dem2d_world *world, bool in_two) {
    world->in_two = in_two;
}

static bool inside_fail(const char *what, int at) {
    fprintf(stderr, "invariant: %s (%d)\n", what, at);
    return false;
}

static bool inside_fields_hold(const dem2di_column *c, int column) {
    for (int f = 0; f < c->count; f++) {
        if (strlen(c->fields[f].name) > 8 * DEM2DI_NAME_WORDS)
            return inside_fail("a field's name is too long", column);
        for (int k = 0; k < f; k++)
            if (strcmp(c->fields[k].name, c->fields[f].name) == 0)
                return inside_fail("two fields of one name", column);
    }
    return true;
}

bool inside_tables_hold(void) {
    for (int i = 0; i < DEM2DI_COLUMNS; i++) {
        const dem2di_column *c = &dem2di_columns[i], *next = c + 1;
        if ((c->name != NULL) != (c->count > 0) || c->count > DEM2DI_FIELDS)
            return inside_fail("number of fields", i);
        if (c->name != NULL && strlen(c->name) > 8 * DEM2DI_NAME_WORDS)
            return inside_fail("a column's name is too long", i);
        for (int k = 0; k < i && c->name != NULL; k++)
            if (dem2di_columns[k].name != NULL && strcmp(dem2di_columns[k].name, c->name) == 0)
                return inside_fail("two columns of one name", i);
        if (!inside_fields_hold(c, i)) return false;
        if ((c->treatment & DEM2DI_SWAPS) && (next->group != c->group || next->size != c->size))
            return inside_fail("a column is swapped with one of another kind", i);
    }
    return true;
}

static const dem2di_column *inside_column(const char *name) {
    const dem2di_column *column = dem2di_columns;
    while (column->name == NULL || strcmp(column->name, name) != 0) column++;
    return column;
}

bool inside_is_setting(const char *column) {
    return inside_column(column)->group == DEM2DI_WORLD;
}

bool inside_is_of_shapes(const char *column) {
    return inside_column(column)->group >= DEM2DI_SHAPE;
}

size_t inside_chunk(void) {
    return DEM2DI_CHUNK;
}

static bool inside_lives(const dem2d_world *w, int slot) {
    return slot >= 0 && slot < w->body_count && w->bodies[slot].shape_index >= 0;
}

static bool inside_ids_hold(const dem2d_world *w) {
    for (int i = 0; i < w->id_count; i++) {
        const int slot = w->ids[i].slot;
        if (slot >= 0 && (!inside_lives(w, slot) || w->bodies[slot].index != i))
            return inside_fail("an id leads to another slot", i);
    }
    for (int slot = 0; slot < w->body_count; slot++)
        if (inside_lives(w, slot) && w->ids[w->bodies[slot].index].slot != slot)
            return inside_fail("a slot leads to another id", slot);
    return true;
}

/* Ranks of particles and walls are their places in the order; if the order is up to date, names
   never fall along it. */
static bool inside_ranks_hold(const dem2d_world *w) {
    uint64_t last = 0;
    for (int place = 0; place < w->id_count; place++) {
        const int index = w->named ? w->order[place].index : place, slot = w->ids[index].slot;
        if (w->named && w->order[index].rank != place) return inside_fail("rank of an id", index);
        if (slot < 0 || w->order_due) continue;
        if (w->bodies[slot].rank != place) return inside_fail("rank of a particle", index);
        if (!w->named) continue;
        if (w->names[slot] < last) return inside_fail("names are out of order", index);
        last = w->names[slot];
    }
    for (int place = 0; place < w->wall_count; place++) {
        const int wall = w->walls[place].placed;
        if (w->walls[wall].rank != place) return inside_fail("rank of a wall", wall);
        if (place > 0 && dem2di_wall_precedes(w->walls, wall, w->walls[place - 1].placed))
            return inside_fail("walls are out of order", wall);
    }
    return true;
}

/* A particle of higher rank, or an image of it; or an image of A that is up, or right. */
static bool inside_is_b(const dem2d_world *w, const dem2di_key *key) {
    const int owner = dem2di_owner(w, key->b);
    if (key->b >= w->body_count && (key->b < w->image_first || key->b >= dem2di_slots(w)))
        return false;
    if (!inside_lives(w, owner)) return false;
    if (owner != key->a) return w->bodies[key->a].rank < w->bodies[owner].rank;
    if (key->b == owner) return false;
    const int *shift = w->images[key->b - w->image_first].shift;
    return shift[1] > 0 || (shift[1] == 0 && shift[0] > 0);
}

/* Each particle leads to all of its images, and to no others. */
static bool inside_images_are_owned(const dem2d_world *w) {
    int owned = 0, found = 0;
    for (int k = 0; k < w->image_count; k++) owned += w->images[k].owner >= 0;
    for (int i = 0; i < w->body_count; i++)
        for (int k = -1; inside_lives(w, i) && dem2di_image_next(w, i, &k);)
            if (k >= w->image_count || w->images[k].owner != i || found++ == owned)
                return inside_fail("a particle leads to the image of another, or twice", i);
    return found == owned || inside_fail("no particle leads to some images", owned - found);
}

/* Images are copies of their owners but for the shift; particles are in the cell, to rounding. */
static bool inside_images_hold(const dem2d_world *w) {
    const dem2di_fractions f = dem2di_fractions_make(&w->cell);
    int out[2];
    for (int k = 0; k < w->image_count; k++) {
        const int slot = w->image_first + k, owner = w->images[k].owner;
        if (owner < 0) continue;
        if (!inside_lives(w, owner)) return inside_fail("the owner of an image is gone", k);
        dem2di_state is = w->now[owner];
        is.x = dem2di_add(
            is.x, dem2di_cell_shift(&w->cell, w->images[k].shift[0], w->images[k].shift[1]));
        if (memcmp(&is, &w->now[slot], sizeof is) != 0 ||
            w->inverse[slot].mass != w->inverse[owner].mass ||
            w->bodies[slot].index != w->bodies[owner].index ||
            w->bodies[slot].rank != w->bodies[owner].rank ||
            w->bodies[slot].material != w->bodies[owner].material ||
            w->bodies[slot].redirected != w->bodies[owner].redirected)
            return inside_fail("an image is not like its owner", k);
        if (w->plan.turns &&
            (w->displacement[slot] != w->displacement[owner] || w->lever[slot] != w->lever[owner]))
            return inside_fail("an image has another displacement", k);
    }
    for (int i = 0; i < w->body_count && w->periodic && !w->wrap_due; i++) {
        if (!inside_lives(w, i) || !dem2di_cells_out(&f, w->now[i].x, out)) continue;
        const double t = (w->now[i].x.y - f.origin.y) * f.per_y;
        const double s = (w->now[i].x.x - f.origin.x) * f.per_x - t * f.slope;
        if (!(s > -1e-12 && s < 1 + 1e-12 && t > -1e-12 && t < 1 + 1e-12))
            return inside_fail("a particle is out of the cell", i);
    }
    return true;
}

static bool inside_contact_holds(const dem2d_world *w, int i) {
    const dem2di_list *list = &w->list;
    const dem2di_key *key = &list->keys[i];
    const bool closed = list->contacts.depth[i] > 0;
    dem2di_contact contact;
    if (key->a < 0)
        return (w->list_stale && !closed) || inside_fail("a forgotten contact is closed", i);
    if (i >= list->pairs && !(key->b >= 0 && key->b % DEM2DI_VERTEX < w->part_count))
        return inside_fail("a wall of a contact is gone", i);
    const int owner = dem2di_owner(w, key->a);
    if (owner != key->a && (i < list->pairs || key->a >= dem2di_slots(w) ||
                            !(w->parts[key->b % DEM2DI_VERTEX].extent > 0)))
        return inside_fail("A of a contact is an image", i);
    if (!inside_lives(w, owner)) return inside_fail("A of a contact is gone", i);
    if (i < list->pairs && !inside_is_b(w, key))
        return inside_fail("B of a contact is gone, or has the lower rank", i);
    (void)dem2di_contact_get(w, &list->contacts, i, &contact);
    const dem2di_groups of_a = dem2di_groups_at(w, key->a);
    const dem2di_groups of_b = i >= list->pairs
                                   ? dem2di_wall_groups(&w->walls[dem2di_wall_of(w, i)])
                                   : dem2di_groups_at(w, key->b);
    if (!dem2di_meet(&of_a, &of_b)) return inside_fail("two are listed that do not meet", i);
    if (!closed && (contact.force != 0 || contact.shear != 0))
        return inside_fail("two that are apart have a force", i);
    if (closed && fabs(dem2di_length(contact.normal) - 1) > 1e-12)
        return inside_fail("a normal is not of unit length", i);
    if (!closed && dem2di_point_pair_of(w, &list->contacts, i) != NULL)
        return inside_fail("two that are apart have points", i);
    return true;
}

/* Each contact is once among those of each of its particles, first those of which it is B. */
static bool inside_adjacency_holds(const dem2d_world *w) {
    const dem2di_list *list = &w->list;
    int listed = 0, entries = 0;
    for (int i = 0; i < list->count; i++)
        listed += list->keys[i].a < 0 ? 0 : i < list->pairs ? 2 : 1;
    for (int slot = 0; slot < w->body_count; slot++) {
        for (int k = list->first[slot]; k < list->first[slot + 1]; k++) {
            const int i = list->adjacent[k];
            if (i < 0 || i >= list->count) return inside_fail("no such contact", i);
            if (list->keys[i].a < 0) continue;
            const bool as_b = k < list->own[slot];
            const int who =
                dem2di_owner(w, as_b && i < list->pairs ? list->keys[i].b : list->keys[i].a);
            if (who != slot || (as_b && i >= list->pairs))
                return inside_fail("a contact of another particle", slot);
            entries++;
        }
    }
    return entries == listed || inside_fail("contacts of particles", entries - listed);
}

/* Walls have their parts one after the other, which are where their states put them. */
static bool inside_parts_hold(const dem2d_world *w) {
    int parts = 0;
    for (int place = 0; place < w->wall_count; place++) {
        const int j = w->walls[place].placed;
        const dem2di_wall *wall = &w->walls[j];
        if (wall->first != parts || wall->alive != (wall->count > 0))
            return inside_fail("parts of a wall", j);
        for (int k = 0; k < wall->count; k++, parts++) {
            const dem2di_surface is = dem2di_surface_of(w, w->wall_now, parts);
            if (w->parts[parts].wall != j) return inside_fail("a part of another wall", parts);
            if (memcmp(&is, &w->surfaces[parts], sizeof is) != 0)
                return inside_fail("a part is elsewhere", parts);
            const dem2di_surface face = dem2di_surface_at(&w->wall_now[j], &w->joints[parts].face);
            if (!w->joints_due && w->parts[parts].extent > 0 &&
                memcmp(&face, &w->face_surfaces[parts], sizeof face) != 0)
                return inside_fail("a face is elsewhere", parts);
        }
    }
    return parts == w->part_count || inside_fail("parts without a wall", parts);
}

bool inside_holds(const dem2d_world *world) {
    if (!inside_ids_hold(world) || !inside_ranks_hold(world) || !inside_adjacency_holds(world))
        return false;
    if (!inside_parts_hold(world)) return false;
    if (!inside_images_are_owned(world) || !inside_images_hold(world)) return false;
    for (int i = 0; i < world->list.count; i++)
        if (!inside_contact_holds(world, i)) return false;
    return true;
}

dem2d_result inside_write_in_vain(const char *path, bool *good) {
    dem2di_writer writer;
    memset(&writer, 0, sizeof writer);
    writer.file = fopen(path, "rb"), writer.good = true;
    dem2di_put(&writer, "a");
    *good = writer.good;
    return dem2di_writer_close(NULL, path, &writer);
}

#endif /* DEM2D_IMPLEMENTATION */
#endif
