/* Volumetric compensation for a controller: the C interface of compensator.hpp, which describes the functions. Lengths
 * in mm, angles in rad. Only load allocates. The other functions do not allocate, lock, throw or make system calls; all
 * except free may be called from several threads concurrently. */
#ifndef STEPDIAG_COMPENSATOR_H
#define STEPDIAG_COMPENSATOR_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct stepdiag_compensator stepdiag_compensator;

enum stepdiag_outside { STEPDIAG_HOLD = 0, STEPDIAG_LINEAR = 1, STEPDIAG_REFUSE = 2 };
enum stepdiag_approach { STEPDIAG_MEAN = 0, STEPDIAG_POSITIVE = 1, STEPDIAG_NEGATIVE = 2 };

/* Flags of a status (see CompensationStatus). 0: the position is inside the volume. */
enum stepdiag_status { STEPDIAG_OUTSIDE = 1, STEPDIAG_CAPPED = 2, STEPDIAG_REFUSED = 4, STEPDIAG_TEMPERATURE = 16 };

/* See CompensatorOptions. Initialise with stepdiag_default_options(), so that future options have their defaults. */
typedef struct {
    double origin[3];
    int outside; /* enum stepdiag_outside */
    double margin;
    double largest_correction;
    int approach; /* enum stepdiag_approach */
    double largest_tool;
    int accept_rejected;    /* 1: accept a table whose fit was rejected */
    int accept_unverified;  /* 1: accept a calibration that was read without a checksum, now or earlier */
    double temperatures[2]; /* lowest and highest that a call may state, degrees Celsius; both 0: none may */
} stepdiag_options;

stepdiag_options stepdiag_default_options(void);

/* `options` may be NULL for the defaults. Returns NULL on failure; `message` then contains the reason, truncated to
 * `message_size` bytes including the terminating 0. */
stepdiag_compensator* stepdiag_compensator_load(const char* path, const char* chain, const stepdiag_options* options,
                                                char* message, size_t message_size);
void stepdiag_compensator_free(stepdiag_compensator* compensator);

/* Each function returns the status, which is STEPDIAG_REFUSED if compensator or position is NULL. A NULL `tool` means
 * the tool of the calibration. Output pointers may be NULL or equal to the input pointer. Without `orientation`, an
 * error takes a third less time. */
unsigned stepdiag_error(const stepdiag_compensator* compensator, const double position[3], const double tool[3],
                        double error[3], double orientation[3]);
unsigned stepdiag_command(const stepdiag_compensator* compensator, const double target[3], const double tool[3],
                          double command[3]);
unsigned stepdiag_forward(const stepdiag_compensator* compensator, const double command[3], const double tool[3],
                          double actual[3]);

/* The same with the temperatures of the scales of X, Y, Z, degrees Celsius; NULL: without. A temperature that is not
 * finite or outside options.temperatures is refused: STEPDIAG_REFUSED | STEPDIAG_TEMPERATURE. */
unsigned stepdiag_error_at_temperature(const stepdiag_compensator* compensator, const double position[3],
                                       const double tool[3], const double temperature[3], double error[3],
                                       double orientation[3]);
unsigned stepdiag_command_at_temperature(const stepdiag_compensator* compensator, const double target[3],
                                         const double tool[3], const double temperature[3], double command[3]);
unsigned stepdiag_forward_at_temperature(const stepdiag_compensator* compensator, const double command[3],
                                         const double tool[3], const double temperature[3], double actual[3]);
/* The same for `count` positions at once, as rows x, y, z: positions[3 * count], and so on; four at a time where the
 * processor has AVX2. `temperature` may be NULL: without. `orientations` and `statuses` [count] may be NULL.
 * STEPDIAG_REFUSED if another pointer is NULL; then nothing is written. Returns the flags of all statuses: 0 if each of
 * them is 0. */
unsigned stepdiag_errors(const stepdiag_compensator* compensator, size_t count, const double* positions,
                         const double tool[3], const double temperature[3], double* errors, double* orientations,
                         unsigned* statuses);
unsigned stepdiag_commands(const stepdiag_compensator* compensator, size_t count, const double* targets,
                           const double tool[3], const double temperature[3], double* commands, unsigned* statuses);

/* Temperature of the scales at which they add nothing, degrees Celsius; NAN unless options.temperatures are stated. */
double stepdiag_temperature_reference(const stepdiag_compensator* compensator);

uint64_t stepdiag_fingerprint(const stepdiag_compensator* compensator);
double stepdiag_inverse_bound(const stepdiag_compensator* compensator);
void stepdiag_calibration_tool(const stepdiag_compensator* compensator, double tool[3]);
/* Verdict of the table's fit: "accepted", "doubtful", "rejected" or "unchecked"; "" if the table has none. */
const char* stepdiag_fit(const stepdiag_compensator* compensator);
/* 1 if the table is unverified (see Compensator::is_unverified), else 0. */
int stepdiag_is_unverified(const stepdiag_compensator* compensator);
/* Parameters that the table does not determine, by index from 0: "EXX", "EYX (slope)", "C0Y". NULL after the last. */
const char* stepdiag_uncompensated(const stepdiag_compensator* compensator, size_t index);

#ifdef __cplusplus
}
#endif

#endif
