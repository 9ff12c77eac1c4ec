// SPDX-License-Identifier: GPL-2.0-or-later
// Load-time arguments of stepdiagkins.c, the only file that includes this one: reads and checks them, and loads the
// table. For a mistake, a message goes to LinuxCNC's error output and the module does not load.
#include <ctype.h>
#include <errno.h>

#define COMPLAIN(...) rtapi_print_msg(RTAPI_MSG_ERR, "stepdiagkins: " __VA_ARGS__)

// Reads `count` numbers separated by commas: "1.5", "10,35" for count = 2, or "0,0,-200" for count = 3.
static int read_numbers(const char* name, const char* text, double* values, int count) {
    const char* rest = text;
    for (int i = 0; i < count; ++i) {
        char* end;
        values[i] = strtod(rest, &end);
        if (end == rest || *end != (i + 1 < count ? ',' : '\0') || !isfinite(values[i])) {
            static const char* const expected[] = {"a number", "two numbers lowest,highest", "three numbers x,y,z"};
            COMPLAIN("%s: expected %s, got \"%s\"\n", name, expected[count - 1], text);
            return -1;
        }
        rest = end + 1;
    }
    return 0;
}

static int read_choice(const char* name, const char* text, const char* const choices[3], int* value) {
    for (*value = 0; *value < 3; ++*value)
        if (choices[*value] && strcmp(text, choices[*value]) == 0) return 0;
    if (choices[2]) COMPLAIN("%s: expected %s, %s or %s, got \"%s\"\n", name, choices[0], choices[1], choices[2], text);
    else COMPLAIN("%s: expected %s or %s, got \"%s\"\n", name, choices[0], choices[1], text);
    return -1;
}

// Adds the primes of the axes before b, because INI files and HAL do not always pass on quotes.
static int read_chain(char* spelled, size_t size) {
    const char* const bed = strchr(chain, 'b');
    size_t n = 0;
    for (const char* c = chain; *c && n + 3 < size; ++c) {
        if (strchr("'\"[] \t", *c)) continue;
        spelled[n++] = *c;
        if (bed && c < bed && *c != 'w') spelled[n++] = '\'';
    }
    spelled[n] = '\0';
    if (n) return 0;
    COMPLAIN("chain: expected the machine's kinematic chain, as in chain=wXbYZt, got none\n");
    return -1;
}

static int read_coordinates(void) {
    int seen[3] = {0, 0, 0};
    joint_count = 0;
    for (const char* c = coordinates; *c; ++c) {
        const char* const letter = strchr(LETTERS, toupper((unsigned char)*c));
        if (!letter || joint_count == MAX_JOINTS) {
            COMPLAIN("coordinates: expected up to %d letters of %s, got \"%s\"\n", MAX_JOINTS, LETTERS, coordinates);
            return -1;
        }
        axis_of_joint[joint_count++] = (int)(letter - LETTERS);
        if (letter - LETTERS < 3) seen[letter - LETTERS] = 1;
    }
    if (seen[0] && seen[1] && seen[2]) return 0;
    COMPLAIN("coordinates: expected X, Y and Z among them, got \"%s\"\n", coordinates);
    return -1;
}

static int read_arguments(void) {
    static const char* const outsides[] = {"hold", "linear", "refuse"};
    static const char* const approaches[] = {"mean", "positive", "negative"};
    static const char* const lengths[] = {"mm", "inch", NULL};
    static const char* const switches[] = {"0", "1", NULL};
    char spelled[64], reason[900];
    double seconds, rate;
    int inch;
    stepdiag_options options = stepdiag_default_options();
    if (read_chain(spelled, sizeof spelled) || read_coordinates() ||
        read_numbers("origin", origin, options.origin, 3) || read_numbers("margin", margin, &options.margin, 1) ||
        read_numbers("largest_correction", largest_correction, &options.largest_correction, 1) ||
        read_numbers("largest_tool", largest_tool, &options.largest_tool, 1) ||
        read_numbers("ramp", ramp, &seconds, 1) || read_numbers("temperature_rate", temperature_rate, &rate, 1) ||
        (*temperatures && read_numbers("temperatures", temperatures, options.temperatures, 2)) ||
        read_choice("outside", outside, outsides, &options.outside) ||
        read_choice("approach", approach, approaches, &options.approach) ||
        read_choice("accept_rejected", accept_rejected, switches, &options.accept_rejected) ||
        read_choice("accept_unverified", accept_unverified, switches, &options.accept_unverified) ||
        read_choice("units", units, lengths, &inch))
        return -1;
    if (!(seconds >= 0.0 && seconds <= 60.0)) {
        COMPLAIN("ramp: expected 0 to 60 s, got \"%s\"\n", ramp);
        return -1;
    }
    if (!(rate > 0.0 && rate <= 10.0)) {
        COMPLAIN("temperature_rate: expected a number above 0 and up to 10 K/s, got \"%s\"\n", temperature_rate);
        return -1;
    }
    if (*temperatures && options.temperatures[0] == 0.0 && options.temperatures[1] == 0.0) {
        COMPLAIN("temperatures: expected the lowest below the highest, got \"%s\"\n", temperatures);
        return -1;
    }
    if (!*table) {
        COMPLAIN("table: expected the path of a calibration file, got none\n");
        return -1;
    }
    compensator = stepdiag_compensator_load(table, spelled, &options, reason, sizeof reason);
    if (!compensator) {
        COMPLAIN("%s\n", reason);
        return -1;
    }
    takes_temperatures = *temperatures != '\0';
    coldest = options.temperatures[0];
    warmest = options.temperatures[1];
    reference = takes_temperatures ? stepdiag_temperature_reference(compensator) : 0.0;
    // Temperatures in force start and end at the reference, and pass all between it and the range.
    if (takes_temperatures && !(coldest <= reference && reference <= warmest)) {
        COMPLAIN("temperatures: expected a range with the calibration's reference %g in it, got \"%s\"\n", reference,
                 temperatures);
        stepdiag_compensator_free(compensator);
        compensator = NULL;
        return -1;
    }
    kelvin_per_ns = rate * 1e-9;
    const char* const fit = stepdiag_fit(compensator);
    if (*fit && strcmp(fit, "accepted") != 0)
        rtapi_print_msg(RTAPI_MSG_WARN, "stepdiagkins: warning: %s: fit=%s, not accepted\n", table, fit);
    if (stepdiag_is_unverified(compensator))
        rtapi_print_msg(RTAPI_MSG_WARN,
                        "stepdiagkins: warning: %s: unverified: its checksum was absent, its values may have been "
                        "changed\n",
                        table);
    stepdiag_calibration_tool(compensator, own_tool);
    mm_per_unit = inch ? 25.4 : 1.0;
    ramp_ns = seconds * 1e9;
    tool_limit = options.largest_tool;
    return 0;
}
