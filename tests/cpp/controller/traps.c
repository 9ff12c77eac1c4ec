/* A controller that traps invalid operations ends at the first comparison with a NaN, unless no entry point makes one.
 * feenableexcept() is of glibc. */
#define _GNU_SOURCE
#include <fenv.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "stepdiag/controller/compensator.h"

const char* stepdiag_trap_failure(const char* path, const char* chain);

#define EXPECT(claim) \
    if (!(claim)) return #claim

enum { ROWS = 9 }; /* two blocks of four, and one row that is left over */

static const double good[3] = {100.0, 200.0, 300.0};

static double from_bits(uint64_t bits) {
    double number;
    memcpy(&number, &bits, sizeof number);
    return number;
}

static int is_refused(unsigned status) { return (status & STEPDIAG_REFUSED) != 0; }
static int is_same(const double a[3], const double b[3]) { return memcmp(a, b, 3 * sizeof *a) == 0; }

/* Every function that answers, asked with three numbers of which one is bad for its position, tool or temperature. */
static const char* answers_failure(const stepdiag_compensator* compensator, const double bad[3]) {
    static const double nothing[3] = {0.0, 0.0, 0.0};
    const double* const asked[3][3] = {{bad, NULL, NULL}, {good, bad, NULL}, {good, NULL, bad}};
    for (int which = 0; which < 3; ++which) {
        const double *const p = asked[which][0], *const tool = asked[which][1], *const temperature = asked[which][2];
        double error[3], turn[3], answer[3];
        EXPECT(is_refused(stepdiag_error_at_temperature(compensator, p, tool, temperature, error, turn)));
        EXPECT(is_same(error, nothing) && is_same(turn, nothing));
        EXPECT(is_refused(stepdiag_command_at_temperature(compensator, p, tool, temperature, answer)));
        EXPECT(is_same(answer, p));
        EXPECT(is_refused(stepdiag_forward_at_temperature(compensator, p, tool, temperature, answer)));
        EXPECT(is_same(answer, p));
        if (!temperature) {
            EXPECT(is_refused(stepdiag_error(compensator, p, tool, error, NULL)) && is_same(error, nothing));
            EXPECT(is_refused(stepdiag_command(compensator, p, tool, answer)) && is_same(answer, p));
            EXPECT(is_refused(stepdiag_forward(compensator, p, tool, answer)) && is_same(answer, p));
        }
        for (int row = 0; row < ROWS; ++row) {
            double rows[ROWS][3], many[ROWS][3], turns[ROWS][3];
            unsigned statuses[ROWS];
            for (int i = 0; i < ROWS; ++i) memcpy(rows[i], i == row ? p : good, sizeof good);
            EXPECT(is_refused(stepdiag_errors(compensator, ROWS, rows[0], tool, temperature, many[0], turns[0],
                                              statuses)));
            EXPECT(is_refused(statuses[row]) && is_same(many[row], nothing) && is_same(turns[row], nothing));
            EXPECT(which != 0 || !is_refused(statuses[(row + 1) % ROWS]));
            EXPECT(is_refused(
                stepdiag_commands(compensator, ROWS, rows[0], tool, temperature, many[0], statuses)));
            EXPECT(is_refused(statuses[row]) && is_same(many[row], rows[row]));
        }
    }
    return NULL;
}

static const char* options_failure(const char* path, const char* chain, double bad) {
    for (int which = 0; which < 8; ++which) {
        char message[300] = "";
        stepdiag_options options = stepdiag_default_options();
        double* const numbers[8] = {&options.origin[0],     &options.origin[1],       &options.origin[2],
                                    &options.margin,        &options.largest_correction, &options.largest_tool,
                                    &options.temperatures[0], &options.temperatures[1]};
        options.outside = STEPDIAG_LINEAR;
        memcpy(numbers[which], &bad, sizeof bad);
        EXPECT(!stepdiag_compensator_load(path, chain, &options, message, sizeof message));
        EXPECT(strstr(message, "expected"));
    }
    return NULL;
}

/* NULL, or the claim that does not hold. `path`: a table that is referred to a temperature. */
const char* stepdiag_trap_failure(const char* path, const char* chain) {
    /* The last two are signalling NaNs: to compute with them at all is an invalid operation. */
    const double bad[] = {from_bits(0x7ff8000000000000u), from_bits(0xfff8000000000000u), HUGE_VAL, -HUGE_VAL,
                          1e300, -1e300, from_bits(0x7ff0000000000001u), from_bits(0xfff0000000000001u)};
    if (feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW) == -1) return NULL; /* a processor that cannot trap */
    const char* failure = NULL;
    for (int outside = STEPDIAG_HOLD; !failure && outside <= STEPDIAG_REFUSE; ++outside) {
        char message[300] = "";
        stepdiag_options options = stepdiag_default_options();
        options.outside = outside;
        options.temperatures[0] = 10.0, options.temperatures[1] = 35.0;
        stepdiag_compensator* compensator = stepdiag_compensator_load(path, chain, &options, message, sizeof message);
        EXPECT(compensator);
        for (size_t b = 0; !failure && b < sizeof bad / sizeof *bad; ++b)
            for (int component = 0; !failure && component < 3; ++component) {
                double numbers[3] = {20.0, 20.0, 20.0};
                memcpy(numbers + component, bad + b, sizeof *bad);
                failure = answers_failure(compensator, numbers);
            }
        stepdiag_compensator_free(compensator);
    }
    for (size_t b = 0; !failure && b < sizeof bad / sizeof *bad; ++b) failure = options_failure(path, chain, bad[b]);
    fedisableexcept(FE_ALL_EXCEPT);
    return failure;
}
