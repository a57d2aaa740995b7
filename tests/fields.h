/* fields.h - the tables of fields of dem2d.h, as tests see them. Include it after dem2d.h; inside.c
   defines it. */
#ifndef FIELDS_H
#define FIELDS_H

/* In the order of dem2di_type. */
typedef enum field_type {
    FIELD_DOUBLE,
    FIELD_VEC,
    FIELD_INT,
    FIELD_ENUM,
    FIELD_POINTER,
    FIELD_BOOL,
    FIELD_ID,
    FIELD_UINT64
} field_type;

typedef struct field_row {
    const char *of;   /* struct */
    const char *name; /* with the names of structs inside: "view.lower" */
    const char *text; /* "unit default; note" */
    char range[64];   /* "" when any value is right */
    double low, high;
    bool above, below, or_0; /* low and high are outside of the range; 0 is in it */
    field_type type;
    size_t offset, size;
} field_row;

/* Row of a number from 0, table after table; false beyond the last. */
bool fields_get(int number, field_row *row);

#ifdef DEM2D_IMPLEMENTATION

/* Structs of which any value of a field is right: the library has no use for a table of them. */
static const dem2di_field env_fields[] = {
    DEM2DI_ROW(dem2d_env, user, DEM2DI_OPTIONAL, "- NULL; handed to the callbacks"),
    DEM2DI_ROW(dem2d_env, allocate, DEM2DI_OPTIONAL, "- malloc; with release, else not used"),
    DEM2DI_ROW(dem2d_env, release, DEM2DI_OPTIONAL, "- free; with allocate, else not used"),
    DEM2DI_ROW(dem2d_env, log, DEM2DI_OPTIONAL, "- silent"),
};
static const dem2di_field save_fields[] = {
    DEM2DI_ROW(dem2d_save_desc, write, DEM2DI_OPTIONAL, "- none; or a path, not both"),
    DEM2DI_ROW(dem2d_save_desc, user, DEM2DI_OPTIONAL, "- NULL"),
};
static const dem2di_field query_fields[] = {
    DEM2DI_ROW(dem2d_query_desc, skip_particles, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_query_desc, skip_walls, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_query_desc, skip_sensors, DEM2DI_SWITCH, "- false"),
    DEM2DI_ROW(dem2d_query_desc, mask, DEM2DI_TAG, "- 0"),
};
static const dem2di_field load_fields[] = {
    DEM2DI_ROW(dem2d_load_desc, read, DEM2DI_OPTIONAL, "- none; or a path, not both"),
    DEM2DI_ROW(dem2d_load_desc, user, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_load_desc, parallel_for, DEM2DI_OPTIONAL, "- NULL; one thread does all"),
    DEM2DI_ROW(dem2d_load_desc, parallel_user, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_load_desc, custom, DEM2DI_OPTIONAL, "- NULL; required for custom shapes"),
    DEM2DI_ROW(dem2d_load_desc, custom_user, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_load_desc, law, DEM2DI_OPTIONAL, "- NULL; required for its worlds"),
    DEM2DI_ROW(dem2d_load_desc, law_user, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_load_desc, law_tag, DEM2DI_TAG, "- 0; as it was saved"),
    DEM2DI_ROW(dem2d_load_desc, env, DEM2DI_OPTIONAL, "- NULL; copied"),
    DEM2DI_ROW(dem2d_load_desc, gather, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_load_desc, commit, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_load_desc, exchange_user, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_load_desc, loads, DEM2DI_OPTIONAL, "- NULL"),
    DEM2DI_ROW(dem2d_load_desc, loads_user, DEM2DI_OPTIONAL, "- NULL"),
};

bool fields_get(int number, field_row *row) {
    static const struct {
        const char *of;
        const dem2di_field *fields;
        int count;
    } tables[] = {
        {"dem2d_env", DEM2DI_ALL(env_fields)},
        {"dem2d_custom_desc", DEM2DI_ALL(dem2di_custom_fields)},
        {"dem2d_reduction_desc", DEM2DI_ALL(dem2di_reduction_fields)},
        {"dem2d_image_desc", DEM2DI_ALL(dem2di_picture_fields)},
        {"dem2d_image_desc", DEM2DI_ALL(dem2di_search_fields)},
        {"dem2d_fit_desc", DEM2DI_ALL(dem2di_fit_fields)},
        {"dem2d_virtual_desc", DEM2DI_ALL(dem2di_virtual_fields)},
        {"dem2d_contact_desc", DEM2DI_ALL(dem2di_contact_fields)},
        {"dem2d_world_desc", DEM2DI_ALL(dem2di_world_fields)},
        {"dem2d_material_desc", DEM2DI_ALL(dem2di_material_fields)},
        {"dem2d_pair_desc", DEM2DI_ALL(dem2di_pair_fields)},
        {"dem2d_particle_desc", DEM2DI_ALL(dem2di_particle_fields)},
        {"dem2d_wall_desc", DEM2DI_ALL(dem2di_wall_fields)},
        {"dem2d_deformation_desc", DEM2DI_ALL(dem2di_deformation_fields)},
        {"dem2d_query_desc", DEM2DI_ALL(query_fields)},
        {"dem2d_grid_desc", DEM2DI_ALL(dem2di_grid_fields)},
        {"dem2d_grading_desc", DEM2DI_ALL(dem2di_grading_fields)},
        {"dem2d_draw_desc", DEM2DI_ALL(dem2di_draw_fields)},
        {"dem2d_fill_desc", DEM2DI_ALL(dem2di_fill_fields)},
        {"dem2d_inlet_desc", DEM2DI_ALL(dem2di_inlet_fields)},
        {"dem2d_growth_desc", DEM2DI_ALL(dem2di_growth_fields)},
        {"dem2d_save_desc", DEM2DI_ALL(save_fields)},
        {"dem2d_load_desc", DEM2DI_ALL(load_fields)},
        {"dem2d_svg_desc", DEM2DI_ALL(dem2di_svg_fields)},
        {"dem2d_vtp_desc", DEM2DI_ALL(dem2di_vtp_fields)},
        {"dem2d_pvd_desc", DEM2DI_ALL(dem2di_pvd_fields)},
        {"dem2d_csv_desc", DEM2DI_ALL(dem2di_csv_fields)},
    };
    int i = 0, count = (int)(sizeof tables / sizeof *tables);
    while (i < count && number >= tables[i].count) number -= tables[i++].count;
    if (i == count) return false;
    const dem2di_field *field = &tables[i].fields[number];
    memset(row, 0, sizeof *row);
    row->of = tables[i].of, row->name = field->name, row->text = field->text;
    row->low = field->low, row->high = field->high;
    row->above = (field->flags & DEM2DI_ABOVE) != 0,
    row->below = (field->flags & DEM2DI_BELOW) != 0;
    row->or_0 = (field->flags & DEM2DI_OR_0) != 0;
    row->type = (field_type)field->type;
    row->offset = field->offset, row->size = field->size;
    const bool bounded = field->low != -DBL_MAX || field->high != DBL_MAX;
    if (field->type == DEM2DI_POINTER && field->low > 0) strcpy(row->range, "required");
    if (field->type <= DEM2DI_VEC && !bounded) strcpy(row->range, "finite");
    if (field->type <= DEM2DI_INT && bounded) dem2di_range_text(field, row->range);
    return true;
}

#endif /* DEM2D_IMPLEMENTATION */
#endif
