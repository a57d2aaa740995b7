// Reads dem2d.h as text and holds it to the rules of its own layout. A check takes texts, prints
// each offending line and returns how many there are; the tests at the end feed every check a
// small text with one fault, which it must find.
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "dem2d.h"
#include "fields.h"

#ifndef HEADER_PATH
#define HEADER_PATH "../dem2d.h" // the environment's DEM2D_HEADER goes first
#endif
#ifndef HELLO_PATH
#define HELLO_PATH "../examples/hello.c" // likewise DEM2D_HELLO
#endif

enum { MAX_COLUMNS = 100, MAX_LINES = 60, MAX_NAMES = 256, NAME = 96, COMMENT = 1024 };

static const char lower[] = "abcdefghijklmnopqrstuvwxyz";
static const char word_characters[] = "abcdefghijklmnopqrstuvwxyz0123456789_"
                                      "ABCDEFGHIJKLMNOPQRSTUVWXYZ";
static const char anchor_characters[] = "abcdefghijklmnopqrstuvwxyz0123456789-";

static bool quiet; // while a text with a fault is checked

// ---- texts ------------------------------------------------------------------------------------

// A text and its lines, without their ends.
typedef struct doc {
    char *text;
    char **line;
    int count;
    bool ends; // the last line has its end
} doc;

// Takes the text over.
static doc doc_make(char *text) {
    doc d = {text, NULL, 0, true};
    size_t length = strlen(text);
    int ends = 0;
    for (size_t i = 0; i < length; i++) ends += text[i] == '\n';
    d.line = calloc((size_t)ends + 1, sizeof *d.line);
    assert_non_null(d.line);
    for (char *start = text; *start;) {
        char *end = strchr(start, '\n');
        d.line[d.count++] = start;
        d.ends = end != NULL;
        if (!end) break;
        *end = '\0';
        start = end + 1;
    }
    return d;
}

static void doc_free(doc *d) {
    free(d->text);
    free(d->line);
}

static doc doc_read(const char *variable, const char *path) {
    const char *other = getenv(variable);
    if (other) path = other;
    FILE *file = fopen(path, "rb");
    if (!file) fail_msg("%s can't be opened (tests run inside tests/)", path);
    size_t size = 0, room = 1 << 16, got;
    char *text = malloc(room + 1);
    while (text && (got = fread(text + size, 1, room - size, file)) > 0) {
        size += got;
        if (size == room) text = realloc(text, (room *= 2) + 1);
    }
    fclose(file);
    assert_non_null(text);
    text[size] = '\0';
    if (strlen(text) != size) fail_msg("%s holds a zero byte", path);
    return doc_make(text);
}

// One error. Line -1: the text as a whole.
static int fault(const doc *d, int line, const char *what, const char *detail) {
    if (quiet) return 1;
    if (line < 0)
        print_error("%s%s\n", what, detail);
    else
        print_error("line %d: %s%s\n    %s\n", line + 1, what, detail, d->line[line]);
    return 1;
}

static bool starts(const char *line, const char *with) {
    return strncmp(line, with, strlen(with)) == 0;
}

// First line from `from` on that starts with this, or -1.
static int line_starting(const doc *d, int from, const char *with) {
    for (int i = from; i >= 0 && i < d->count; i++)
        if (starts(d->line[i], with)) return i;
    return -1;
}

// Does the line hold this as a word of C (followed by the rest of `word` as it stands)?
static bool has_word(const char *line, const char *word) {
    for (const char *at = strstr(line, word); at; at = strstr(at + 1, word)) {
        char before = at == line ? ' ' : at[-1], after = at[strlen(word)];
        bool call = word[strlen(word) - 1] == '(';
        if (!strchr(word_characters, before) && (call || !after || !strchr(word_characters, after)))
            return true;
    }
    return false;
}

// ---- names and sections -----------------------------------------------------------------------

// Names with the lines they stand in.
typedef struct list {
    char name[MAX_NAMES][NAME];
    int line[MAX_NAMES];
    int count;
} list;

static void list_add(list *l, const char *first, const char *second, int line) {
    assert_true(l->count < MAX_NAMES);
    snprintf(l->name[l->count], NAME, "%s%s", first, second);
    l->line[l->count++] = line;
}

// Index of a name from `from` on, or -1.
static int list_find(const list *l, int from, const char *name) {
    for (int i = from; i < l->count; i++)
        if (strcmp(l->name[i], name) == 0) return i;
    return -1;
}

// All anchors (">>" and a word) of the lines first .. last - 1.
static void anchors_of(const doc *d, int first, int last, list *anchors) {
    anchors->count = 0;
    for (int i = first; i >= 0 && i < last; i++) {
        for (const char *at = strstr(d->line[i], ">>"); at; at = strstr(at + 2, ">>")) {
            size_t length = strspn(at + 2, anchor_characters);
            if (length == 0 || length >= NAME || !strchr(lower, at[2])) continue;
            char name[NAME] = {0};
            memcpy(name, at + 2, length);
            list_add(anchors, name, "", i);
        }
    }
}

// The list of contents, and the headings: every anchor after it.
static void anchors_read(const doc *d, list *contents, list *headings) {
    int first = line_starting(d, 0, "CONTENTS"), last = line_starting(d, first, "====");
    anchors_of(d, first, last, contents);
    anchors_of(d, last, d->count, headings);
}

static bool is_implementation(const char *anchor) {
    return strcmp(anchor, "manual") != 0 && strcmp(anchor, "licence") != 0 &&
           !starts(anchor, "api-");
}

// Line of a heading and of the next one; false if there is none.
static bool section(const list *headings, int lines, const char *name, int *first, int *last) {
    int i = list_find(headings, 0, name);
    if (i < 0) return false;
    *first = headings->line[i];
    *last = i + 1 < headings->count ? headings->line[i + 1] : lines;
    return true;
}

// The declarations: from the heading api-types to the first heading of the implementation.
static bool declarations(const doc *d, int *first, int *last) {
    list contents, headings;
    anchors_read(d, &contents, &headings);
    if (!section(&headings, d->count, "api-types", first, last)) return false;
    for (int i = list_find(&headings, 0, "api-types"); i < headings.count; i++) {
        *last = i + 1 < headings.count ? headings.line[i + 1] : d->count;
        if (i + 1 < headings.count && !starts(headings.name[i + 1], "api-")) break;
    }
    return true;
}

// ---- checks -----------------------------------------------------------------------------------

// Every anchor of the contents heads one section, in the order of the contents.
static int check_anchors(const doc *d, const doc *hello) {
    (void)hello;
    list contents, headings;
    anchors_read(d, &contents, &headings);
    if (contents.count == 0) return fault(d, -1, "no contents", "");
    int errors = 0, latest = -1;
    for (int i = 0; i < contents.count; i++) {
        const char *name = contents.name[i];
        int first = list_find(&headings, 0, name);
        if (list_find(&contents, i + 1, name) >= 0)
            errors += fault(d, contents.line[i], "twice in the contents: ", name);
        if (first < 0) errors += fault(d, contents.line[i], "no section: ", name);
        int second = first < 0 ? -1 : list_find(&headings, first + 1, name);
        if (second >= 0) errors += fault(d, headings.line[second], "doubled: ", name);
    }
    for (int i = 0; i < headings.count; i++) {
        int place = list_find(&contents, 0, headings.name[i]);
        if (place < 0)
            errors += fault(d, headings.line[i], "not in the contents: ", headings.name[i]);
        else if (place < latest)
            errors += fault(d, headings.line[i], "out of order: ", headings.name[i]);
        else
            latest = place;
    }
    return errors;
}

// Lines of the declarations that start so have a comment right above.
static int check_commented(const doc *d, const char *start) {
    int first, last, errors = 0, found = 0;
    if (!declarations(d, &first, &last)) return fault(d, -1, "no declarations", "");
    for (int i = first; i < last; i++) {
        if (!starts(d->line[i], start)) continue;
        found++;
        if (!starts(d->line[i - 1], "///")) errors += fault(d, i, "no /// comment above", "");
    }
    return found ? errors : fault(d, -1, "nothing declared: ", start);
}

static int check_functions(const doc *d, const doc *hello) {
    (void)hello;
    return check_commented(d, "DEM2D_API ");
}

static int check_types(const doc *d, const doc *hello) {
    (void)hello;
    return check_commented(d, "typedef ");
}

// Name of the field that a line declares: "" if it can't be told, false for other lines.
static bool field_of(const char *line, char name[NAME]) {
    size_t blank = strspn(line, " ");
    if (!line[blank] || line[blank] == '/') return false;
    const char *end = strchr(line, ';'), *pointer = strstr(line, "(*");
    name[0] = '\0';
    if (!end) return true;
    const char *start = pointer && pointer < end ? pointer + 2 : NULL;
    if (!start) {
        const char *bracket = strchr(line, '['), *comma = strchr(line, ',');
        if (comma && comma < end) return true; // one field a line
        if (bracket && bracket < end) end = bracket;
        start = end;
        while (start > line && strchr(word_characters, start[-1])) start--;
    }
    size_t length = strspn(start, word_characters);
    if (length < NAME) {
        memcpy(name, start, length);
        name[length] = '\0';
    }
    return true;
}

// "struct field" of each member of dem2d_env and the structs named *_desc.
static void fields_read(const doc *d, list *fields) {
    fields->count = 0;
    for (int i = 0; i < d->count; i++) {
        char type[NAME / 2], field[NAME];
        if (sscanf(d->line[i], "typedef struct %47[a-z0-9_]", type) != 1) continue;
        size_t length = strlen(type);
        bool options = length > 5 && strcmp(type + length - 5, "_desc") == 0;
        if (!options && strcmp(type, "dem2d_env") != 0) continue;
        if (!strchr(d->line[i], '{')) continue;
        strcat(type, " ");
        for (i++; i < d->count && !starts(d->line[i], "}"); i++)
            if (field_of(d->line[i], field)) list_add(fields, type, field, i);
    }
}

// The tables of fields: those of dem2d.h, or the sample's.
typedef struct table {
    field_row row[MAX_NAMES];
    int count;
} table;

static table real_fields, *known = &real_fields;

// The part of a text up to a separator or its end; the text goes on behind it.
static void part_of(const char **text, const char *separator, char part[NAME]) {
    const char *end = strstr(*text, separator);
    int length = end ? (int)(end - *text) : (int)strlen(*text);
    snprintf(part, NAME, "%.*s", length, *text);
    *text = end ? end + strlen(separator) : "";
}

// The comment of the field that a line declares: `///` above, `///<` behind and below.
static void field_comment(const doc *d, int line, char text[COMMENT]) {
    int first = line, last = line + 1;
    while (first > 0 && strstr(d->line[first - 1], "    /// ") == d->line[first - 1]) first--;
    while (last < d->count && starts(d->line[last] + strspn(d->line[last], " "), "///<")) last++;
    size_t used = 0;
    text[0] = '\0';
    for (int i = first; i < last; i++) {
        const char *slashes = strstr(d->line[i], "///");
        if (!slashes) continue;
        slashes += slashes[3] == '<' ? 4 : 3;
        used += (size_t)snprintf(text + used, COMMENT - used, "%s", slashes);
        if (used >= COMMENT) return;
    }
}

// Does a text have a part, with a blank before it and none of these characters behind?
static bool has_part(const char *text, const char *part, const char *not_behind) {
    for (const char *at = text; (at = strstr(at, part)) != NULL; at++) {
        const char behind = at[strlen(part)];
        if (at > text && at[-1] == ' ' && !(behind && strchr(not_behind, behind))) return true;
    }
    return false;
}

// A range as a comment has it: "2 to 256" of "0 or 2 to 256", 2^30 of 1073741824.
static void range_in_words(const field_row *row, char range[NAME]) {
    const char *text = row->range;
    if (starts(text, "0 or ")) text += 5;
    if (starts(text, "in ")) text += 3;
    snprintf(range, NAME, "%s", text);
    for (int power = 15; power < 31; power += 15) {
        char digits[16];
        snprintf(digits, sizeof digits, "%d", 1 << power);
        for (char *at; (at = strstr(range, digits)) != NULL;) {
            memmove(at + 4, at + strlen(digits), strlen(at + strlen(digits)) + 1);
            memcpy(at, power == 15 ? "2^15" : "2^30", 4);
        }
    }
}

// "struct " and the field of a row: "dem2d_svg_desc " and "view" for its parts.
static void row_field(const field_row *row, char type[NAME], char field[NAME]) {
    const char *rest = row->name;
    part_of(&rest, ".", field);
    snprintf(type, NAME, "%s ", row->of);
}

static void rows_read(list *rows) {
    rows->count = 0;
    for (int i = 0; i < known->count; i++) {
        char type[NAME], field[NAME];
        row_field(&known->row[i], type, field);
        list_add(rows, type, field, i);
        int last = rows->count - 1; // the parts of a field follow each other
        if (last > 0 && strcmp(rows->name[last], rows->name[last - 1]) == 0) rows->count--;
    }
}

// Fields of the descs and rows of the tables are the same.
static int check_fields(const doc *d, const doc *hello) {
    (void)hello;
    list fields, rows;
    fields_read(d, &fields);
    rows_read(&rows);
    if (fields.count == 0 || rows.count == 0) return fault(d, -1, "no fields or no table", "");
    int errors = 0;
    for (int i = 0; i < fields.count; i++)
        if (list_find(&rows, 0, fields.name[i]) < 0)
            errors += fault(d, fields.line[i], "not in the tables of fields: ", fields.name[i]);
    for (int i = 0; i < rows.count; i++)
        if (list_find(&fields, 0, rows.name[i]) < 0)
            errors += fault(d, -1, "no such field: ", rows.name[i]);
    return errors;
}

// The comment of a field says the unit, the default and the range that its row has.
static int option_faults(const doc *d, const field_row *row, int line) {
    char unit[NAME], value[NAME], range[NAME], wanted[NAME + 8], text[COMMENT];
    const char *rest = row->text;
    part_of(&rest, " ", unit);
    part_of(&rest, "; ", value);
    field_comment(d, line, text);
    range_in_words(row, range);
    int errors = 0;
    if (strcmp(unit, "-") != 0 && !has_part(text, unit, word_characters))
        errors += fault(d, line, "its comment needs the unit ", unit);
    snprintf(wanted, sizeof wanted, "0 for %s", value);
    if (strtod(value, NULL) > 0 && !has_part(text, wanted, word_characters))
        errors += fault(d, line, "its comment needs ", wanted);
    if (range[0] && strcmp(range, "finite") != 0 && !has_part(text, range, "0123456789^."))
        errors += fault(d, line, "its comment needs the range ", range);
    return errors;
}

static int check_options(const doc *d, const doc *hello) {
    (void)hello;
    list fields;
    fields_read(d, &fields);
    int errors = 0;
    if (known->count == 0) return fault(d, -1, "no table", "");
    for (int i = 0; i < known->count; i++) {
        char type[NAME], field[NAME], name[2 * NAME];
        row_field(&known->row[i], type, field);
        snprintf(name, sizeof name, "%s%s", type, field);
        int at = list_find(&fields, 0, name);
        if (at >= 0) errors += option_faults(d, &known->row[i], fields.line[at]);
    }
    return errors;
}

// The manual's quick start, less its indent of four, is hello.c.
static int check_quick_start(const doc *d, const doc *hello) {
    int first = line_starting(d, 0, "QUICK START");
    if (first < 0) return fault(d, -1, "no quick start", "");
    for (first++; first < d->count && !d->line[first][0];) first++;
    int last = first;
    while (last < d->count && (!d->line[last][0] || starts(d->line[last], "    "))) last++;
    while (last > first && !d->line[last - 1][0]) last--;
    for (int i = 0; i < last - first || i < hello->count; i++) {
        if (i >= last - first) return fault(hello, i, "hello.c goes on: ", "");
        const char *line = d->line[first + i];
        if (line[0]) line += 4;
        if (i >= hello->count) return fault(d, first + i, "hello.c has ended", "");
        if (strcmp(line, hello->line[i]) != 0)
            return fault(d, first + i, "hello.c has: ", hello->line[i]);
    }
    if (hello->count == 0 || !hello->ends) return fault(d, -1, "hello.c ends within a line", "");
    return 0;
}

// What is #defined under a name, or "".
static const char *macro(const doc *d, const char *name) {
    char start[NAME];
    snprintf(start, sizeof start, "#define %s ", name);
    int i = line_starting(d, 0, start);
    return i < 0 ? "" : d->line[i] + strlen(start);
}

// Does the definition of a macro, in this line and those that it goes on in, have a word?
static bool macro_has(const doc *d, const char *name, const char *word) {
    char start[NAME];
    snprintf(start, sizeof start, "#define %s ", name);
    for (int i = line_starting(d, 0, start); i >= 0 && i < d->count; i++) {
        if (has_word(d->line[i], word)) return true;
        const size_t length = strlen(d->line[i]);
        if (length == 0 || d->line[i][length - 1] != '\\') break;
    }
    return false;
}

// Banner, macros and the newest entry of the changes give one version. What follows from the three
// numbers must be written with them; test_shapes compares the values.
static int check_versions(const doc *d, const doc *hello) {
    (void)hello;
    int errors = 0, first = 0, last = 0, part[3] = {0};
    const char *const names[3] = {"DEM2D_VERSION_MAJOR", "DEM2D_VERSION_MINOR",
                                  "DEM2D_VERSION_PATCH"};
    for (int i = 0; i < 3; i++)
        if (sscanf(macro(d, names[i]), "%d", &part[i]) != 1)
            errors += fault(d, -1, "not defined as a number: ", names[i]);
    char version[NAME], found[NAME] = "";
    snprintf(version, sizeof version, "%d.%d.%d", part[0], part[1], part[2]);
    for (int i = 0; i < 3; i++)
        if (!macro_has(d, "DEM2D_VERSION", names[i]) ||
            !macro_has(d, "DEM2D_VERSION_STRING", names[i]))
            errors += fault(d, -1, "DEM2D_VERSION or its string does without ", names[i]);
    const char *banner = d->count ? strstr(d->line[0], "version ") : NULL;
    if (!banner || sscanf(banner, "version %31[0-9.]", found) != 1 || strcmp(found, version) != 0)
        errors += fault(d, 0, "the first line does not say version ", version);

    list contents, headings;
    anchors_read(d, &contents, &headings);
    if (!section(&headings, d->count, "licence", &first, &last))
        return errors + fault(d, -1, "no section: ", "licence");
    for (int i = first; i < last; i++) {
        int entry[3];
        if (sscanf(d->line[i], " %d.%d.%d", &entry[0], &entry[1], &entry[2]) != 3) continue;
        if (memcmp(entry, part, sizeof part) == 0) return errors;
        return errors + fault(d, i, "the newest change is not of version ", version);
    }
    return errors + fault(d, first, "no changes of a version", "");
}

// Only the section on memory allocates and frees.
static int check_memory(const doc *d, const doc *hello) {
    (void)hello;
    static const char *const calls[] = {"malloc(", "calloc(", "realloc(", "free("};
    list contents, headings;
    anchors_read(d, &contents, &headings);
    int first = d->count, last = d->count, errors = 0;
    section(&headings, d->count, "memory", &first, &last);
    for (int i = 0; i < d->count; i++) {
        if (i >= first && i < last) continue;
        for (size_t c = 0; c < sizeof calls / sizeof *calls; c++)
            if (has_word(d->line[i], calls[c]))
                errors += fault(d, i, "outside the section on memory: ", calls[c]);
    }
    return errors;
}

// ASCII without tabs, 100 columns.
static int check_text(const doc *d, const doc *hello) {
    (void)hello;
    int errors = 0;
    for (int i = 0; i < d->count; i++) {
        bool tab = strchr(d->line[i], '\t') != NULL, other = false;
        for (const char *c = d->line[i]; *c; c++)
            other = other || (*c != '\t' && (*c < ' ' || *c > '~'));
        if (tab) errors += fault(d, i, "a tab", "");
        if (other) errors += fault(d, i, "a byte that is not printable ASCII", "");
        if (strlen(d->line[i]) > MAX_COLUMNS) errors += fault(d, i, "over 100 columns", "");
    }
    return d->count ? errors : fault(d, -1, "no text", "");
}

// A function begins at the last line before it that begins with a letter, and ends at a brace.
static int check_lengths(const doc *d, const doc *hello) {
    (void)hello;
    int errors = 0, start = -1;
    for (int i = 0; i < d->count; i++) {
        const char first = d->line[i][0];
        if (first && strchr(word_characters, first)) start = i;
        if (strcmp(d->line[i], "}") != 0) continue;
        if (start >= 0 && i - start >= MAX_LINES)
            errors += fault(d, start, "a function of more than 60 lines", "");
        start = -1;
    }
    return errors;
}

static int check_goto(const doc *d, const doc *hello) {
    (void)hello;
    int errors = 0;
    for (int i = 0; i < d->count; i++)
        if (has_word(d->line[i], "goto")) errors += fault(d, i, "a goto", "");
    return errors;
}

// The names of the library on a line of the manual that stand nowhere below it. "dem2d_shape_*" is
// any that begins so.
static int names_faults(const doc *d, int line, int below) {
    int errors = 0;
    for (const char *at = d->line[line]; *at;) {
        char name[NAME] = {0};
        const size_t length = strspn(at, word_characters);
        const bool ours = starts(at, "dem2d_") || starts(at, "DEM2D_");
        if (ours && length < NAME) {
            memcpy(name, at, length);
            const bool family = name[length - 1] == '_';
            bool found = false;
            for (int i = below; i < d->count && !found; i++)
                found = family ? strstr(d->line[i], name) != NULL : has_word(d->line[i], name);
            if (!found) errors += fault(d, line, "no such name below: ", name);
        }
        at += length ? length : 1;
    }
    return errors;
}

static int check_names(const doc *d, const doc *hello) {
    (void)hello;
    const int first = line_starting(d, 0, ">>manual"), end = line_starting(d, first, "*/");
    if (first < 0 || end < 0) return fault(d, -1, "no manual", "");
    int errors = 0;
    for (int i = first; i < end; i++) errors += names_faults(d, i, end);
    return errors;
}

// The words after "uses:" are anchors above this one, or "nothing"; stated[] gets their places in
// the contents.
static int uses_faults(const doc *d, int line, const list *contents, int self, bool *stated) {
    const char *at = strstr(d->line[line], "uses:") + 5;
    int errors = 0, words = 0;
    at += strspn(at, " ");
    if (strcmp(at, "nothing") == 0) return 0;
    for (;; words++) {
        char name[NAME] = {0};
        size_t length = strspn(at, anchor_characters);
        if (length == 0 || length >= NAME)
            return errors + fault(d, line, "not a list of words", "");
        memcpy(name, at, length);
        int place = list_find(contents, 0, name);
        if (place < 0) errors += fault(d, line, "uses what is not in the contents: ", name);
        if (place == self) errors += fault(d, line, "uses itself: ", name);
        if (place > self) errors += fault(d, line, "uses a section below: ", name);
        if (place >= 0) stated[place] = true;
        at += length;
        if (strcmp(at, ",") == 0 && line + 1 < d->count) { // goes on in the next line
            at = d->line[++line];
            at += strspn(at, " ");
            continue;
        }
        if (!*at) return errors;
        at += strspn(at, ", ");
    }
}

// The heading of section s of the contents: its lines, and which sections it says it uses.
static int heading_faults(const doc *d, const list *contents, const list *headings, int s,
                          int *first, int *last, bool *stated) {
    int errors = 0, found = 0;
    memset(stated, 0, MAX_NAMES * sizeof *stated);
    if (!section(headings, d->count, contents->name[s], first, last)) {
        *first = *last = 0;
        return fault(d, contents->line[s], "no section: ", contents->name[s]);
    }
    for (int i = *first; i < *last && !strstr(d->line[i], "*/"); i++) {
        const char *text = d->line[i] + strspn(d->line[i], " ");
        if (!starts(text, "uses:")) continue;
        errors += found++ ? fault(d, i, "a second line of uses", "")
                          : uses_faults(d, i, contents, s, stated);
    }
    if (!found) errors += fault(d, *first, "no line \"uses: ...\" in the heading", "");
    return errors;
}

// Every section of the implementation says in its heading which sections above it uses.
static int check_uses(const doc *d, const doc *hello) {
    (void)hello;
    list contents, headings;
    anchors_read(d, &contents, &headings);
    int errors = 0, sections = 0, first, last;
    bool stated[MAX_NAMES];
    for (int s = 0; s < contents.count; s++) {
        if (!is_implementation(contents.name[s])) continue;
        sections++;
        errors += heading_faults(d, &contents, &headings, s, &first, &last, stated);
    }
    return sections ? errors : fault(d, -1, "no implementation", "");
}

// ---- what sections call -----------------------------------------------------------------------

// Private names and public functions, and the section of each: its place in the contents. There are
// no forward declarations, so a private name first stands where it is defined.
typedef struct definitions {
    char (*name)[NAME];
    int *place;
    int count, room;
} definitions;

static int definitions_find(const definitions *all, const char *name) {
    for (int i = 0; i < all->count; i++)
        if (strcmp(all->name[i], name) == 0) return i;
    return -1;
}

static void definitions_add(definitions *all, const char *name, int place) {
    if (definitions_find(all, name) >= 0) return;
    if (all->count == all->room) {
        all->room = 2 * all->room + 64;
        all->name = realloc(all->name, (size_t)all->room * sizeof *all->name);
        all->place = realloc(all->place, (size_t)all->room * sizeof *all->place);
        assert_non_null(all->name);
        assert_non_null(all->place);
    }
    strcpy(all->name[all->count], name);
    all->place[all->count++] = place;
}

// The next word of a line's code from *at on, outside comments and literals; false at its end.
static bool word_next(const char **at, bool *comment, char word[NAME]) {
    const char *c = *at;
    while (*c) {
        size_t length = strspn(c, word_characters);
        if (*comment) {
            c = strstr(c, "*/");
            if (!c) return false;
            c += 2;
            *comment = false;
        } else if (starts(c, "/*")) {
            c += 2;
            *comment = true;
        } else if (starts(c, "//")) {
            return false;
        } else if (*c == '"' || *c == '\'') {
            const char quote = *c++;
            while (*c && *c != quote) c += *c == '\\' && c[1] ? 2 : 1;
            if (*c) c++;
        } else if (length == 0) {
            c++;
        } else {
            snprintf(word, NAME, "%.*s", (int)length, c);
            *at = c + length;
            return true;
        }
    }
    return false;
}

static bool is_private(const char *word) {
    return starts(word, "dem2di_") || starts(word, "DEM2DI_");
}

static void section_defines(const doc *d, int first, int last, int place, definitions *all) {
    bool comment = true; // the heading
    char word[NAME];
    for (int i = first; i < last; i++) {
        const bool declares = starts(d->line[i], "DEM2D_API ");
        for (const char *at = d->line[i]; word_next(&at, &comment, word);)
            if (is_private(word) || (declares && starts(word, "dem2d_") && *at == '('))
                definitions_add(all, word, place);
    }
}

// Sections whose names this one uses without saying so, and the other way round.
static int section_faults(const doc *d, int first, int last, int place, const list *contents,
                          const definitions *all, const bool *stated) {
    bool comment = true, used[MAX_NAMES] = {false};
    char word[NAME];
    int errors = 0;
    for (int i = first; i < last; i++)
        for (const char *at = d->line[i]; word_next(&at, &comment, word);) {
            const int found =
                is_private(word) || starts(word, "dem2d_") ? definitions_find(all, word) : -1;
            const int other = found < 0 ? place : all->place[found];
            if (other == place || used[other]) continue;
            used[other] = true;
            if (!stated[other])
                errors +=
                    fault(d, i, "uses what the heading does not name: ", contents->name[other]);
        }
    for (int s = 0; s < contents->count; s++) // config gives the C library, too
        if (stated[s] && !used[s] && strcmp(contents->name[s], "config") != 0)
            errors += fault(d, first, "uses nothing of ", contents->name[s]);
    return errors;
}

// A section uses what its heading names, and nothing else.
static int check_calls(const doc *d, const doc *hello) {
    (void)hello;
    list contents, headings;
    definitions all = {NULL, NULL, 0, 0};
    bool stated[MAX_NAMES];
    int errors = 0, first, last;
    anchors_read(d, &contents, &headings);
    for (int s = 0; s < contents.count; s++)
        if (is_implementation(contents.name[s]) &&
            section(&headings, d->count, contents.name[s], &first, &last))
            section_defines(d, first, last, s, &all);
    for (int s = 0; s < contents.count; s++) {
        if (!is_implementation(contents.name[s])) continue;
        errors += heading_faults(d, &contents, &headings, s, &first, &last, stated);
        errors += section_faults(d, first, last, s, &contents, &all, stated);
    }
    free(all.name);
    free(all.place);
    return all.count ? errors : fault(d, -1, "nothing defined", "");
}

// Every public function is named in the manual: in an example, a how-to or a concept. "dem2d_x_*"
// names all that begin so.
static int check_named(const doc *d, const doc *hello) {
    (void)hello;
    int first, last, errors = 0;
    const int manual = line_starting(d, 0, ">>manual"), options = line_starting(d, manual, "OPTI");
    if (manual < 0 || options < 0) return fault(d, -1, "no manual with options", "");
    if (!declarations(d, &first, &last)) return fault(d, -1, "no declarations", "");
    for (int i = first; i < last; i++) {
        if (!starts(d->line[i], "DEM2D_API ")) continue;
        const char *at = strchr(d->line[i], '('), *begin = at;
        while (begin && begin > d->line[i] && strchr(word_characters, begin[-1])) begin--;
        char name[NAME] = {0}, family[NAME];
        if (!begin || at - begin >= NAME - 1) return fault(d, i, "no function", "");
        memcpy(name, begin, (size_t)(at - begin));
        bool found = false;
        for (int k = manual; k < options && !found; k++) found = has_word(d->line[k], name);
        for (size_t n = strlen(name); n > 6 && !found; n--) {
            if (name[n - 1] != '_') continue;
            snprintf(family, sizeof family, "%.*s*", (int)n, name);
            for (int k = manual; k < options && !found; k++)
                found = strstr(d->line[k], family) != NULL;
        }
        if (!found) errors += fault(d, i, "not in the manual: ", name);
    }
    return errors;
}

// ---- texts with one fault ---------------------------------------------------------------------

static const char sample_hello[] = "int main(void) {\n\n    return 0;\n}\n";

static table sample_fields = {
    {{.of = "dem2d_env", .name = "user", .text = "- NULL"},
     {.of = "dem2d_env", .name = "log", .text = "- silent"},
     {.of = "dem2d_some_desc",
      .name = "width",
      .text = "m 800; of the grain",
      .range = "0 or >= 3"},
     {.of = "dem2d_some_desc", .name = "spans.lower", .text = "- all", .range = "finite"},
     {.of = "dem2d_some_desc", .name = "spans.upper", .text = "- false"}},
    5};

static const char sample[] =
    "/* dem2d.h - a sample, version 1.2.3\n"
    "\n"
    "CONTENTS (\">>\" and the word)\n"
    "    Manual          what it is          >>manual\n"
    "    Declarations    types               >>api-types\n"
    "                    mass                >>api-mass\n"
    "    Implementation  compiler            >>config\n"
    "                    memory              >>memory\n"
    "                    mass                >>mass\n"
    "    Changes                             >>licence\n"
    "=============\n"
    ">>manual\n"
    "HOW TO dem2d_version(), dem2d_area()\n"
    "QUICK START (the same bytes)\n"
    "\n"
    "    int main(void) {\n"
    "\n"
    "        return 0;\n"
    "    }\n"
    "\n"
    "OPTIONS\n"
    "    In the comments.\n"
    "\n"
    "ERRORS\n"
    "=============\n"
    "*/\n"
    "/* ==========\n"
    "   >>api-types  Version, environment\n"
    "   ========== */\n"
    "#define DEM2D_VERSION_MAJOR 1\n"
    "#define DEM2D_VERSION_MINOR 2\n"
    "#define DEM2D_VERSION_PATCH 3\n"
    "#define DEM2D_VERSION NUMBER(DEM2D_VERSION_MAJOR, DEM2D_VERSION_MINOR, DEM2D_VERSION_PATCH)\n"
    "#define DEM2D_VERSION_STRING \\\n"
    "    TEXT(DEM2D_VERSION_MAJOR, DEM2D_VERSION_MINOR, DEM2D_VERSION_PATCH)\n"
    "/// Wide: 000000019 000000029 000000039 000000049 000000059 "
    "000000069 000000079 000000089 000000099|\n"
    "/// Memory.\n"
    "typedef struct dem2d_env {\n"
    "    void *user; ///< handed on; to the callbacks\n"
    "    /// Particulars.\n"
    "    void (*log)(void *user, const char *text);\n"
    "} dem2d_env;\n"
    "/// Some.\n"
    "typedef struct dem2d_some_desc {\n"
    "    double width;    ///< m, of the grain, >= 3;\n"
    "                     ///< 0 for 800\n"
    "    double spans[2]; ///< m\n"
    "} dem2d_some_desc;\n"
    "/// An enum.\n"
    "typedef enum dem2d_kind { DEM2D_KIND } dem2d_kind;\n"
    "/// The version.\n"
    "DEM2D_API int dem2d_version(void);\n"
    "/* ==========\n"
    "   >>api-mass  Area\n"
    "   ========== */\n"
    "/// Area\n"
    "/// of a shape.\n"
    "DEM2D_API double dem2d_area(double x,\n"
    "                            double y);\n"
    "/* ==========\n"
    "   >>config  Compiler\n"
    "   uses: nothing\n"
    "   ========== */\n"
    "/* ==========\n"
    "   >>memory  Allocation\n"
    "   uses: config\n"
    "   ========== */\n"
    "static void *dem2di_new(size_t size) { return malloc(size); }\n"
    "static double dem2di_free(double x) { return x; }\n"
    "/* ==========\n"
    "   >>mass  Area\n"
    "   Of everything.\n"
    "   uses: config, memory\n"
    "   ========== */\n"
    "DEM2D_API double dem2d_area(double x, double y) { return dem2di_free(x) * y; }\n"
    "/*\n"
    "   >>licence  Changes, licence\n"
    "     1.2.3  Later.\n"
    "     1.2.2  First.\n"
    "*/\n";

typedef int check_fn(const doc *header, const doc *hello);

typedef struct rule {
    const char *name;
    check_fn *check;
} rule;

static rule rules[] = {
    {"anchors: once, as in the contents", check_anchors},
    {"functions have a comment", check_functions},
    {"types have a comment", check_types},
    {"tables of fields hold the fields of the descs", check_fields},
    {"options are those of the tables", check_options},
    {"quick start is hello.c", check_quick_start},
    {"versions agree", check_versions},
    {"allocation only in its section", check_memory},
    {"ASCII, no tabs, 100 columns", check_text},
    {"no function over 60 lines", check_lengths},
    {"no goto", check_goto},
    {"sections use those above", check_uses},
    {"sections use what they name", check_calls},
    {"the manual names what is there", check_names},
    {"the manual names every function", check_named},
};

// The check must reject the sample once `from` (its first occurrence) has become `to`.
typedef struct mutation {
    const char *name;
    check_fn *check;
    const char *from, *to;
} mutation;

static mutation mutations[] = {
    {"rejects: contents missing", check_anchors, "CONTENTS", "WHAT IS IN IT"},
    {"rejects: section missing", check_anchors, "   >>mass  Area", "   mass  Area"},
    {"rejects: api- for the plain word", check_anchors, "   >>mass  Area", "   >>mass-api  Area"},
    {"rejects: section doubled", check_anchors, "   uses: nothing", "   >>config  again"},
    {"rejects: contents doubled", check_anchors, "types               >>api-types",
     "types    >>memory   >>api-types"},
    {"rejects: sections out of order", check_anchors,
     ">>api-types\n                    mass                >>api-mass",
     ">>api-mass\n                    mass                >>api-types"},
    {"rejects: section not in the contents", check_anchors, "   Of everything.",
     "   >>hull  Hulls"},
    {"rejects: function without comment", check_functions, "/// The version.\n", "\n"},
    {"rejects: function after a blank", check_functions, "/// of a shape.\n", "\n"},
    {"rejects: no functions", check_functions, ">>api-types  Version", "Version"},
    {"rejects: struct without comment", check_types, "/// Some.\n", "// Some.\n"},
    {"rejects: enum without comment", check_types, "/// An enum.\n", ""},
    {"rejects: field without row", check_fields, "    double spans[2];",
     "    double height;\n    double spans[2];"},
    {"rejects: callback without row", check_fields, "(*log)", "(*message)"},
    {"rejects: array without row", check_fields, "spans[2];", "lengths[2];"},
    {"rejects: two fields in a line", check_fields, "double spans[2]", "double width, spans[2]"},
    {"rejects: row without field", check_fields,
     "    double width;    ///< m, of the grain, >= 3;\n", ""},
    {"rejects: unit", check_options, "< m, of", "< px, of"},
    {"rejects: power of a unit", check_options, "< m, of", "< m2, of"},
    {"rejects: no unit", check_options, "< m, of", "< of"},
    {"rejects: default", check_options, "0 for 800", "0 for 80"},
    {"rejects: default with more digits", check_options, "0 for 800", "0 for 8000"},
    {"rejects: range", check_options, ">= 3", "> 3"},
    {"rejects: range with more digits", check_options, ">= 3", ">= 30"},
    {"rejects: no comment", check_options, "///< m, of the grain, >= 3;", ""},
    {"rejects: quick start differs", check_quick_start, "        return 0;", "        return 1;"},
    {"rejects: quick start is longer", check_quick_start, "    }\n\nOPT", "    }\n    ;\n\nOPT"},
    {"rejects: quick start is shorter", check_quick_start, "    }\n\nOPT", "\nOPT"},
    {"rejects: quick start missing", check_quick_start, "QUICK START", "START"},
    {"rejects: version of the banner", check_versions, "version 1.2.3", "version 1.2.4"},
    {"rejects: major version", check_versions, "MAJOR 1", "MAJOR 2"},
    {"rejects: minor version", check_versions, "MINOR 2", "MINOR 3"},
    {"rejects: patch missing", check_versions, "PATCH 3", "PITCH 3"},
    {"rejects: version as number", check_versions, "NUMBER(DEM2D_VERSION_MAJOR,", "NUMBER(1,"},
    {"rejects: version as text", check_versions, "TEXT(DEM2D_VERSION_MAJOR,", "TEXT(1,"},
    {"rejects: newest change", check_versions, "     1.2.3  Later.\n", ""},
    {"rejects: no changes", check_versions, ">>licence  Changes", "Changes"},
    {"rejects: malloc elsewhere", check_memory, "dem2di_free(x)", "*(double *)malloc(8)"},
    {"rejects: free elsewhere", check_memory, "{ return dem2di_free(x)", "{ free(x); return (x)"},
    {"rejects: realloc elsewhere", check_memory, "dem2di_free(x)", "realloc(x)"},
    {"rejects: calloc elsewhere", check_memory, "/* ==========\n   >>config",
     "calloc(1)\n/*>>config"},
    {"rejects: malloc, no section on memory", check_memory, "   >>memory ", "   memory "},
    {"rejects: tab", check_text, "    double spans", "\tdouble spans"},
    {"rejects: accent", check_text, "Some.", "S\xc3\xb6me."},
    {"rejects: carriage return", check_text, "/// Some.", "/// Some.\r"},
    {"rejects: 101 columns", check_text, "|\n", "||\n"},
    {"rejects: 61 lines", check_lengths, "double x) { return x; }\n",
     "double x) {\n"
     "\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n"
     "\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n"
     "    return x;\n}\n"},
    {"rejects: goto", check_goto, "{ return malloc", "{ goto end; return malloc"},
    {"rejects: goto at the end of a line", check_goto, "/// Some.", "goto"},
    {"rejects: no uses", check_uses, "   uses: config\n", ""},
    {"rejects: empty uses", check_uses, "   uses: config\n", "   uses:\n"},
    {"rejects: uses below", check_uses, "   uses: config\n", "   uses: config, mass\n"},
    {"rejects: uses itself", check_uses, "   uses: config\n", "   uses: memory\n"},
    {"rejects: uses the unknown", check_uses, "   uses: config\n", "   uses: config, hull\n"},
    {"rejects: uses goes on", check_uses, "   uses: config, memory\n", "   uses: config,\n"},
    {"rejects: uses twice", check_uses, "   uses: config\n", "   uses: config\n   uses: config\n"},
    {"rejects: uses after the heading", check_uses, "   uses: config\n   ========== */\n",
     "   ========== */\n   uses: config\n"},
    {"rejects: calls a section it does not name", check_calls, "   uses: config, memory\n",
     "   uses: config\n"},
    {"rejects: calls a section below", check_calls, "return malloc(size);",
     "return dem2d_area(1, 2);"},
    {"rejects: names a section it does not call", check_calls, "dem2di_free(x) * y",
     "x * y /* dem2di_free */"},
    {"rejects: a function that the manual does not name", check_named, "dem2d_version()", "it"},
    {"rejects: a function whose name is longer", check_named, "dem2d_area()", "dem2d_area_of()"},
    {"rejects: no sections", check_uses, "CONTENTS", "WHAT IS IN IT"},
    {"rejects: a function that is not there", check_names, "QUICK START (the same bytes)\n",
     "QUICK START: dem2d_versions()\n"},
    {"rejects: a value that is not there", check_names, "\nERRORS\n", "\nERRORS DEM2D_KINDS.\n"},
    {"rejects: a family that is not there", check_names, "\nERRORS\n", "\nERRORS dem2d_such_*\n"},
    {"rejects: no manual", check_names, ">>manual\nHOW", "manual\nHOW"},
};

enum { RULES = sizeof rules / sizeof *rules, MUTATIONS = sizeof mutations / sizeof *mutations };

// ---- tests ------------------------------------------------------------------------------------

static void test_rule(void **state) {
    const rule *r = *state;
    known = &real_fields;
    for (real_fields.count = 0; fields_get(real_fields.count, &real_fields.row[real_fields.count]);)
        real_fields.count++;
    doc header = doc_read("DEM2D_HEADER", HEADER_PATH), hello = doc_read("DEM2D_HELLO", HELLO_PATH);
    int errors = r->check(&header, &hello);
    doc_free(&header);
    doc_free(&hello);
    assert_int_equal(errors, 0);
}

// `text` with the first `from` replaced.
static doc doc_replaced(const char *text, const char *from, const char *to) {
    const char *at = strstr(text, from);
    assert_non_null(at);
    char *changed = malloc(strlen(text) + strlen(to) + 1);
    assert_non_null(changed);
    size_t before = (size_t)(at - text);
    memcpy(changed, text, before);
    strcpy(changed + before, to);
    strcat(changed, at + strlen(from));
    return doc_make(changed);
}

static void test_sample(void **state) {
    (void)state;
    known = &sample_fields;
    doc header = doc_replaced(sample, "", ""), hello = doc_replaced(sample_hello, "", "");
    int errors = 0;
    for (int i = 0; i < RULES; i++) errors += rules[i].check(&header, &hello);
    doc_free(&header);
    doc_free(&hello);
    assert_int_equal(errors, 0);
}

static void test_mutation(void **state) {
    const mutation *m = *state;
    known = &sample_fields;
    doc header = doc_replaced(sample, m->from, m->to), hello = doc_replaced(sample_hello, "", "");
    quiet = true;
    int errors = m->check(&header, &hello);
    quiet = false;
    doc_free(&header);
    doc_free(&hello);
    assert_int_not_equal(errors, 0);
}

// The first block of C in a text is a file, byte by byte; how many lines it has, or -1.
static int block_lines(const doc *readme, const doc *world) {
    int first = line_starting(readme, 0, "```c") + 1;
    if (first == 0 || world->count == 0 || !world->ends) return -1;
    for (int i = 0; i < world->count; i++) {
        if (first + i >= readme->count) return -1;
        if (strcmp(readme->line[first + i], world->line[i]) == 0) continue;
        return -fault(readme, first + i, "world.c has: ", world->line[i]);
    }
    int last = first + world->count;
    if (last < readme->count && strcmp(readme->line[last], "```") == 0) return world->count;
    return -fault(readme, first, "world.c has ended", "");
}

// The world of the README is a program of the examples, which are compiled and run.
static void test_readme(void **state) {
    (void)state;
    doc readme = doc_read("DEM2D_README", "../README.md");
    doc world = doc_read("DEM2D_WORLD", "../examples/world.c");
    doc hello = doc_read("DEM2D_HELLO", HELLO_PATH);
    int lines = block_lines(&readme, &world);
    bool programs = line_starting(&readme, 0, "    cc -I. examples/hello.c -lm") >= 0;
    quiet = true;
    int other = block_lines(&readme, &hello);
    quiet = false;
    doc_free(&readme);
    doc_free(&world);
    doc_free(&hello);
    assert_in_range(lines, 15, 30);
    assert_true(programs);
    assert_int_equal(other, -1);
}

// Lines of a document that give a compiler or linker /dev/null as its output: run by root, some
// (tcc) put a file there.
static int null_outputs(const doc *d) {
    int count = 0;
    for (int i = 0; i < d->count; i++)
        count +=
            strstr(d->line[i], "-o /dev/null") != NULL || strstr(d->line[i], "-o/dev/null") != NULL;
    return count;
}

static void test_recipes(void **state) {
    (void)state;
    static const char *const paths[] = {"Makefile", "../examples/Makefile", "compile_matrix.sh",
                                        "bench_cost.sh", "../.ci/run"};
    char bad[] = "\tcc probe.c -o /dev/null";
    char *line = bad;
    doc sample = {.line = &line, .count = 1};
    assert_int_equal(null_outputs(&sample), 1);
    for (size_t k = 0; k < sizeof paths / sizeof *paths; k++) {
        doc recipes = doc_read("", paths[k]);
        int count = null_outputs(&recipes), lines = recipes.count;
        doc_free(&recipes);
        assert_true(lines > 5);
        assert_int_equal(count, 0);
    }
}

int main(void) {
    struct CMUnitTest tests[RULES + 3 + MUTATIONS] = {{0}};
    int count = 0;
    for (int i = 0; i < RULES; i++, count++) {
        tests[count].name = rules[i].name;
        tests[count].test_func = test_rule;
        tests[count].initial_state = &rules[i];
    }
    tests[count].name = "accepts: a sample without faults";
    tests[count++].test_func = test_sample;
    tests[count].name = "the README's world is world.c";
    tests[count++].test_func = test_readme;
    tests[count].name = "no recipe writes to /dev/null";
    tests[count++].test_func = test_recipes;
    for (int i = 0; i < MUTATIONS; i++, count++) {
        tests[count].name = mutations[i].name;
        tests[count].test_func = test_mutation;
        tests[count].initial_state = &mutations[i];
    }
    return cmocka_run_group_tests_name("dem2d.h as text", tests, NULL, NULL);
}
