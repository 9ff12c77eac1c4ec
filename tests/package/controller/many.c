/* The answer of examples/compensate.c, as the last of five in one call. */
#include <stdio.h>
#include <stepdiag/controller/compensator.h>

int main(int count, char** arguments) {
    char reason[300];
    const double targets[15] = {0, 0, 0, 100, 100, 100, 200, 200, 200, 300, 300, 300, 700, 500, 400};
    double commands[15];
    stepdiag_compensator* c =
        stepdiag_compensator_load(count > 1 ? arguments[1] : NULL, "wX'bYZt", NULL, reason, sizeof reason);
    if (!c) return fprintf(stderr, "many: %s\n", reason), 2;
    if (stepdiag_commands(c, 5, targets, NULL, NULL, commands, NULL)) return 1;
    printf("%.4f %.4f %.4f\n", commands[12], commands[13], commands[14]);
    stepdiag_compensator_free(c);
    return 0;
}
