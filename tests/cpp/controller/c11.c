/* The C header as a C11 compiler sees it, and its functions as a C program calls them. */
#include <math.h>
#include <string.h>

#include "stepdiag/controller/compensator.h"

const char* stepdiag_c11_failure(const char* path, const char* chain);

#define EXPECT(claim) \
    if (!(claim)) return #claim

/* NULL, or the claim that does not hold. */
const char* stepdiag_c11_failure(const char* path, const char* chain) {
    const double position[3] = {100.0, 200.0, 300.0}, nowhere[3] = {NAN, 0.0, 0.0};
    double error[3], orientation[3], command[3], actual[3];
    char message[200] = "";
    stepdiag_options options = stepdiag_default_options();
    stepdiag_compensator* compensator = stepdiag_compensator_load(path, chain, NULL, message, sizeof message);
    EXPECT(compensator != NULL);
    EXPECT(stepdiag_fingerprint(compensator) != 0);
    EXPECT(stepdiag_error(compensator, position, NULL, error, orientation) == 0);
    EXPECT(stepdiag_command(compensator, position, NULL, command) == 0);
    EXPECT(stepdiag_forward(compensator, command, NULL, actual) == 0);
    for (int i = 0; i < 3; ++i) {
        EXPECT(error[i] != 0.0 && orientation[i] != 0.0);
        EXPECT(fabs(actual[i] - position[i]) <= stepdiag_inverse_bound(compensator));
        EXPECT(fabs(command[i] - (position[i] - error[i])) < 1e-3);
    }
    const double positions[6] = {100.0, 200.0, 300.0, 100.0, 200.0, NAN};
    double errors[6];
    unsigned statuses[2];
    EXPECT(stepdiag_errors(compensator, 2, positions, NULL, NULL, errors, NULL, statuses) == STEPDIAG_REFUSED);
    EXPECT(statuses[0] == 0 && statuses[1] == STEPDIAG_REFUSED && errors[0] == error[0] && errors[5] == 0.0);
    EXPECT(stepdiag_commands(compensator, 1, positions, NULL, NULL, errors, NULL) == 0 && errors[0] == command[0]);
    EXPECT(stepdiag_command(compensator, nowhere, NULL, command) == STEPDIAG_REFUSED);
    EXPECT(isnan(command[0]) && command[1] == 0.0);
    EXPECT(stepdiag_command_at_temperature(compensator, position, NULL, NULL, command) == 0);
    EXPECT(stepdiag_command_at_temperature(compensator, position, NULL, position, command) ==
           (STEPDIAG_REFUSED | STEPDIAG_TEMPERATURE)); /* none was stated when it was loaded */
    EXPECT(isnan(stepdiag_temperature_reference(compensator)));
    stepdiag_compensator_free(compensator);

    options.temperatures[0] = 10.0;
    options.temperatures[1] = 35.0;
    EXPECT(stepdiag_compensator_load(path, chain, &options, message, sizeof message) == NULL);
    EXPECT(strstr(message, "referred to a temperature") != NULL);
    options = stepdiag_default_options();

    options.outside = STEPDIAG_REFUSE;
    options.origin[0] = 1000.0;
    compensator = stepdiag_compensator_load(path, chain, &options, NULL, 0);
    EXPECT(compensator != NULL);
    EXPECT(stepdiag_error(compensator, position, NULL, error, NULL) == (STEPDIAG_OUTSIDE | STEPDIAG_REFUSED));
    stepdiag_compensator_free(compensator);

    EXPECT(stepdiag_compensator_load(path, "wZbXYt", NULL, message, sizeof message) == NULL);
    EXPECT(strstr(message, "chain: expected the controller's [w Z b X Y t]") == NULL); /* Z needs a prime there */
    EXPECT(strstr(message, "chain") != NULL);
    return NULL;
}
