// The unit behind a number: after exactly one space the longest run of known units, such as `mm`, `N*s/m` or `m^2`.
// What follows no number, stands behind more or less than one space, or is no unit is left to the grammar:
// `2 min(a, b)` has no unit, and `2 m / s` is a length over something called `s`.

#include "tree_sitter/parser.h"

#include <string.h>

enum { UNIT };

// The names of units, as in `compiler/lang/src/units/table.rs`; a test compares the two.
static const char *const UNITS[] = {
    "kg", "g", "mg", "km", "m", "cm", "mm", "um", "s", "ms", "us", "ns", "rad", "mrad", "deg", "Hz", "kHz", "MHz",
    "N", "kN", "mN", "cN", "gf", "J", "mJ", "W", "mW", "Pa", "kPa", "A", "mA", "uA", "V", "mV", "ohm", "H", "mH",
};
enum { LONGEST_NAME = 8 };

static bool begins_word(int32_t c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_';
}

static bool is_digit(int32_t c) { return c >= '0' && c <= '9'; }

// Reads a word; whether it is the name of a unit.
static bool scan_name(TSLexer *lexer) {
    char name[LONGEST_NAME + 1];
    size_t length = 0;
    if (!begins_word(lexer->lookahead)) { return false; }
    while (begins_word(lexer->lookahead) || is_digit(lexer->lookahead)) {
        if (length < LONGEST_NAME) { name[length] = (char)lexer->lookahead; }
        length++;
        lexer->advance(lexer, false);
    }
    if (length > LONGEST_NAME) { return false; }
    name[length] = 0;
    for (size_t i = 0; i < sizeof UNITS / sizeof *UNITS; i++) {
        if (strcmp(name, UNITS[i]) == 0) { return true; }
    }
    return false;
}

// `^2` or `^-1`, one digit. A longer number is left to the operator `^`, and so is a name. Whether the unit may go on.
// A number with a point (`^2.5`) is taken for its first digit, as no two characters can be looked at ahead.
static bool scan_exponent(TSLexer *lexer) {
    if (lexer->lookahead != '^') { return true; }
    lexer->advance(lexer, false);
    if (lexer->lookahead == '-') { lexer->advance(lexer, false); }
    if (!is_digit(lexer->lookahead)) { return false; }
    lexer->advance(lexer, false);
    if (begins_word(lexer->lookahead) || is_digit(lexer->lookahead)) { return false; }
    lexer->mark_end(lexer);
    return true;
}

static bool scan_unit(TSLexer *lexer) {
    if (lexer->lookahead != ' ') { return false; }
    lexer->advance(lexer, true);
    if (!scan_name(lexer)) { return false; }
    for (;;) {
        lexer->mark_end(lexer);
        if (!scan_exponent(lexer)) { return true; }
        if (lexer->lookahead != '*' && lexer->lookahead != '/') { return true; }
        lexer->advance(lexer, false);
        if (!scan_name(lexer)) { return true; }
    }
}

void *tree_sitter_whip_external_scanner_create(void) { return NULL; }
void tree_sitter_whip_external_scanner_destroy(void *payload) { (void)payload; }
unsigned tree_sitter_whip_external_scanner_serialize(void *payload, char *buffer) {
    (void)payload;
    (void)buffer;
    return 0;
}
void tree_sitter_whip_external_scanner_deserialize(void *payload, const char *buffer, unsigned length) {
    (void)payload;
    (void)buffer;
    (void)length;
}

bool tree_sitter_whip_external_scanner_scan(void *payload, TSLexer *lexer, const bool *valid) {
    (void)payload;
    if (!valid[UNIT] || !scan_unit(lexer)) { return false; }
    lexer->result_symbol = UNIT;
    return true;
}
