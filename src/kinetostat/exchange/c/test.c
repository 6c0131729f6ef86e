/* section: always */
$note
#include "@stem@.h"

#include <math.h>
#include <stdio.h>

$arrays

static int failures = 0;

/* Compare numbers with those expected, by a share of a scale; infinite ones must be equal. */
static void compare(const char *what, int row, int count, const machine_real *found, const double *expected, double scale)
{
    const double agreed = sizeof(machine_real) < sizeof(double) ? 1e-5 : $agreed;
    for (int k = 0; k < count; k++) {
        const double off = fabs((double)found[k] - expected[k]);
        const int same = isfinite(expected[k]) ? off <= agreed * scale
                       : isnan(expected[k])  ? isnan((double)found[k])
                                             : (double)found[k] == expected[k];
        if (!same) {
            printf("%s %d at pose %d: %.17g instead of %.17g\n", what, k, row, (double)found[k], expected[k]);
            failures++;
        }
    }
}

/* Compare matrices; the scale of an entry is that of the diagonal entries in its row and column. */
static void compare_matrices(const char *what, int row, const machine_real *found, const double *expected)
{
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < 6; j++) {
            const double scale = sqrt(fabs(expected[7 * i] * expected[7 * j]));
            compare(what, row, 1, found + 6 * i + j, expected + 6 * i + j, isfinite(scale) ? scale : fabs(expected[6 * i + j]));
        }
    }
}

/* section: scale */
static double largest(int count, const double *numbers)
{
    double result = 0.0;
    for (int k = 0; k < count; k++) {
        result = isfinite(numbers[k]) ? fmax(result, fabs(numbers[k])) : result;
    }
    return result;
}

/* section: always */
int main(void)
{
    for (int row = 0; row < $rows; row++) {
        machine_real in[MACHINE_INPUTS], coordinates[MACHINE_ACTUATORS];
        for (int k = 0; k < MACHINE_INPUTS; k++) {
            in[k] = (machine_real)POSES[row][k];
        }
        machine_real stiffness[36], compliance[36];
        if (machine_matrices(in, stiffness, compliance) != MACHINE_OK) {
            printf("pose %d has no matrices\n", row);
            failures++;
        }
        compare_matrices("stiffness", row, stiffness, REFERENCE_MATRICES[row]);
        compare_matrices("compliance", row, compliance, REFERENCE_MATRICES[row] + 36);
        machine_real rates[MACHINE_ACTUATORS * MACHINE_INPUTS];
        machine_actuators(in, coordinates, rates);
        compare("actuator", row, MACHINE_ACTUATORS, coordinates, REFERENCE_COORDINATES[row], 1.0);
/* section: forward */
        machine_real back[MACHINE_INPUTS];
        for (int k = 0; k < MACHINE_INPUTS; k++) {
            back[k] = (machine_real)POSES[0][k];
        }
        machine_forward(coordinates, back);
        compare("coordinate", row, MACHINE_COORDINATES, back, POSES[row], 1.0);
/* section: rest */
        machine_real displacement[6];
        if (machine_rest(in, displacement) == MACHINE_OK) {
            compare("displacement", row, 6, displacement, REFERENCE_DISPLACEMENT[row],
                    fmax(1e-3, largest(6, REFERENCE_DISPLACEMENT[row])));
        }
        if (machine_command(in, coordinates) == MACHINE_OK) {
            compare("command", row, MACHINE_ACTUATORS, coordinates, REFERENCE_COMMAND[row], $command_scale);
        }
/* section: quantities */
        machine_real quantities[MACHINE_QUANTITIES], slopes[MACHINE_QUANTITIES * MACHINE_INPUTS];
        const int answered = machine_quantities(in, quantities, slopes) == MACHINE_OK;
        for (int k = 0; answered && k < MACHINE_QUANTITIES; k++) {
            compare("quantity", row, 1, quantities + k, REFERENCE_QUANTITIES[row] + k, fabs(REFERENCE_QUANTITIES[row][k]));
            const double *expected = REFERENCE_SLOPES[row] + k * MACHINE_INPUTS;
            compare("slope", row, MACHINE_INPUTS, slopes + k * MACHINE_INPUTS, expected,
                    largest(MACHINE_INPUTS, expected));
        }
/* section: always */
    }
    printf("%d poses, %d differences\n", $rows, failures);
    return failures > 0;
}
