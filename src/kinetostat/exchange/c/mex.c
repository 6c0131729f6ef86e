/* section: always */
$note
/* Functions of the machine in MATLAB and Octave. Build: mex @stem@_mex.c @stem@.c
   A column of `points` is one point:
$given   [K, C, status] = @stem@_mex('matrices', points)                K and C [6 x 6 x n]
   [coordinates, slopes, status] = @stem@_mex('actuators', points)     [$actuators x n], [$inputs x $actuators x n]
/* section: forward */
   [points, status] = @stem@_mex('forward', coordinates, points)       from points nearby [$inputs x n]
/* section: rest */
   [displacement, status] = @stem@_mex('rest', points)                 [6 x n]
   [coordinates, status] = @stem@_mex('command', points)               [$actuators x n]
/* section: quantities */
   [values, slopes, status] = @stem@_mex('quantities', points)         [$quantities x n], [$inputs x $quantities x n]
/* section: always */
   SI units. Statuses are those of @stem@.h; where one is not 0, results are NaN. */
#include "mex.h"
#include "@stem@.h"

#include <string.h>

static const struct {
    const char *name;
    int sizes[2][2]; /* rows and columns of the results at a point; one of 0 rows is none */
} TASKS[] = {
    {"matrices", {{6, 6}, {6, 6}}},
    {"actuators", {{MACHINE_ACTUATORS, 1}, {MACHINE_INPUTS, MACHINE_ACTUATORS}}},
/* section: forward */
    {"forward", {{MACHINE_INPUTS, 1}, {0, 0}}},
/* section: rest */
    {"rest", {{6, 1}, {0, 0}}},
    {"command", {{MACHINE_ACTUATORS, 1}, {0, 0}}},
/* section: quantities */
    {"quantities", {{MACHINE_QUANTITIES, 1}, {MACHINE_INPUTS, MACHINE_QUANTITIES}}},
/* section: always */
};

static int at_point(const char *task, const double *point, double *first, double *second)
{
/* section: forward */
    if (!strcmp(task, "forward")) {
        return machine_forward(point, first);
    }
/* section: rest */
    if (!strcmp(task, "rest")) {
        return machine_rest(point, first);
    }
    if (!strcmp(task, "command")) {
        return machine_command(point, first);
    }
/* section: quantities */
    if (!strcmp(task, "quantities")) {
        return machine_quantities(point, first, second);
    }
/* section: always */
    return strcmp(task, "matrices") ? machine_actuators(point, first, second) : machine_matrices(point, first, second);
}

static const double *numbers(const mxArray *given, size_t rows, const char *what)
{
    if (!mxIsDouble(given) || mxIsComplex(given) || mxGetM(given) != rows) {
        mexErrMsgIdAndTxt("@stem@:shape", "%s must be real doubles with %d rows; a column is a point.", what, (int)rows);
    }
    return mxGetPr(given);
}

void mexFunction(int nlhs, mxArray *plhs[], int nrhs, const mxArray *prhs[])
{
    char name[16] = "";
    const size_t known = sizeof TASKS / sizeof TASKS[0];
    size_t task = 0;
    if (nrhs >= 1) {
        mxGetString(prhs[0], name, sizeof name);
    }
    while (task < known && strcmp(name, TASKS[task].name)) {
        task++;
    }
    const int forward = !strcmp(name, "forward");
    if (task == known || nrhs != 2 + forward) {
        mexErrMsgIdAndTxt("@stem@:usage", "Call @stem@_mex('matrices', points), or as the head of @stem@_mex.c says.");
    }
    const double *points = numbers(prhs[1], forward ? MACHINE_ACTUATORS : MACHINE_INPUTS, "The second argument");
    const size_t stride = mxGetM(prhs[1]), count = mxGetN(prhs[1]), results = TASKS[task].sizes[1][0] ? 2 : 1;
    const double *start = forward ? numbers(prhs[2], MACHINE_INPUTS, "The third argument") : NULL;
    if (forward && mxGetN(prhs[2]) != count) {
        mexErrMsgIdAndTxt("@stem@:shape", "The third argument must have as many columns as the second.");
    }
    mxArray *answers[3];
    size_t sizes[2] = {0, 0};
    double *values[2] = {NULL, NULL};
    for (size_t k = 0; k < results; k++) {
        const size_t rows = (size_t)TASKS[task].sizes[k][0], columns = (size_t)TASKS[task].sizes[k][1];
        const mwSize shape[3] = {rows, columns == 1 ? count : columns, columns == 1 ? 1 : count};
        sizes[k] = rows * columns;
        answers[k] = mxCreateNumericArray(3, shape, mxDOUBLE_CLASS, mxREAL);
        values[k] = mxGetPr(answers[k]);
    }
    answers[results] = mxCreateDoubleMatrix(1, count, mxREAL);
    double *status = mxGetPr(answers[results]);
    if (forward) {
        memcpy(values[0], start, count * MACHINE_INPUTS * sizeof(double));
    }
    for (size_t n = 0; n < count; n++) {
        double *second = values[1] ? values[1] + n * sizes[1] : NULL;
        status[n] = at_point(name, points + n * stride, values[0] + n * sizes[0], second);
    }
    for (size_t k = 0; k <= results; k++) {
        if (k == 0 || (int)k < nlhs) {
            plhs[k] = answers[k];
        } else {
            mxDestroyArray(answers[k]);
        }
    }
}
