/* Loads a calibration and prints where the axes must stand for the tool to be at a point.
 * compensate CALIBRATION.csv */
#include <stdio.h>
#include <stepdiag/controller/compensator.h>

int main(int count, char** arguments) {
    char reason[300];
    const double target[3] = {700.0, 500.0, 400.0};
    double command[3];
    stepdiag_compensator* c =
        stepdiag_compensator_load(count > 1 ? arguments[1] : NULL, "wX'bYZt", NULL, reason, sizeof reason);
    if (!c) return fprintf(stderr, "compensate: %s\n", reason), 2;

    if (stepdiag_command(c, target, NULL, command) & STEPDIAG_REFUSED) return 1;

    printf("%.4f %.4f %.4f\n", command[0], command[1], command[2]);
    stepdiag_compensator_free(c);
    return 0;
}
