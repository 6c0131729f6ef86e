/* section: always */
$note
#include "@stem@.h"

#include <math.h>

$constants
$programs
static void take(const machine_real *given, double *in)
{
    for (int k = 0; k < MACHINE_INPUTS; k++) {
        in[k] = (double)given[k];
        if (IS_ANGLE[k] && fabs(in[k]) > LARGEST_ANGLE) {
            in[k] = atan2(sin(in[k]), cos(in[k]));
        }
    }
}

int machine_matrices(const machine_real in[], machine_real stiffness[36], machine_real compliance[36])
{
    double at[MACHINE_INPUTS], out[42];
    take(in, at);
    const int status = entries_at(at, out);
    for (int i = 0, entry = 0; i < 6; i++) {
        for (int j = i; j < 6; j++, entry++) {
            compliance[6 * i + j] = compliance[6 * j + i] = (machine_real)out[entry];
            stiffness[6 * i + j] = stiffness[6 * j + i] = (machine_real)out[21 + entry];
        }
    }
    return status;
}

int machine_actuators(const machine_real in[], machine_real coordinates[], machine_real *slopes)
{
    double at[MACHINE_INPUTS], out[MACHINE_ACTUATORS * (1 + MACHINE_INPUTS)];
    take(in, at);
    const int status = slopes ? actuator_slopes_at(at, out) : actuators_at(at, out);
    for (int k = 0; k < MACHINE_ACTUATORS; k++) {
        coordinates[k] = (machine_real)out[k];
    }
    for (int k = 0; slopes && k < MACHINE_ACTUATORS * MACHINE_INPUTS; k++) {
        slopes[k] = (machine_real)out[MACHINE_ACTUATORS + k];
    }
    return status;
}
/* section: solve */

/* Solve n equations by elimination with row exchanges; 0 where they are singular. */
static int solve(int n, double *matrix, double *right)
{
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++) {
            if (fabs(matrix[i * n + k]) > fabs(matrix[pivot * n + k])) {
                pivot = i;
            }
        }
        if (!(fabs(matrix[pivot * n + k]) > 0.0)) {
            return 0;
        }
        for (int j = 0; j < n; j++) {
            const double kept = matrix[k * n + j];
            matrix[k * n + j] = matrix[pivot * n + j];
            matrix[pivot * n + j] = kept;
        }
        const double kept = right[k];
        right[k] = right[pivot];
        right[pivot] = kept;
        for (int i = k + 1; i < n; i++) {
            const double share = matrix[i * n + k] / matrix[k * n + k];
            for (int j = k; j < n; j++) {
                matrix[i * n + j] -= share * matrix[k * n + j];
            }
            right[i] -= share * right[k];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++) {
            right[k] -= matrix[k * n + j] * right[j];
        }
        right[k] /= matrix[k * n + k];
    }
    return 1;
}
/* section: forward */

/* How far the actuators are from where they should be, in lengths of the machine or rad: all, and the largest. */
static double actuators_off(const double *out, const double *wanted, double *off)
{
    double largest = 0.0;
    for (int k = 0; k < MACHINE_ACTUATORS; k++) {
        off[k] = wanted[k] - out[k];
        off[k] = IS_SLIDE[k] ? off[k] / LENGTH : atan2(sin(off[k]), cos(off[k]));
        largest = fabs(off[k]) > largest || !(fabs(off[k]) <= HUGE_VAL) ? fabs(off[k]) : largest;
    }
    return largest;
}

int machine_forward(const machine_real coordinates[], machine_real in[])
{
    double at[MACHINE_INPUTS], next[MACHINE_INPUTS], out[MACHINE_ACTUATORS * (1 + MACHINE_INPUTS)];
    double wanted[MACHINE_ACTUATORS], off[MACHINE_ACTUATORS], matrix[MACHINE_ACTUATORS * MACHINE_COORDINATES];
    take(in, at);
    for (int k = 0; k < MACHINE_ACTUATORS; k++) {
        wanted[k] = (double)coordinates[k];
    }
    int status = actuator_slopes_at(at, out);
    double left = actuators_off(out, wanted, off);
    for (int step = 0; step < STEPS_FORWARD && status == MACHINE_OK && left > 0.0; step++) {
        for (int i = 0; i < MACHINE_ACTUATORS; i++) {
            for (int j = 0; j < MACHINE_COORDINATES; j++) {
                const double slope = out[MACHINE_ACTUATORS + i * MACHINE_INPUTS + j];
                matrix[i * MACHINE_COORDINATES + j] = IS_SLIDE[i] ? slope / LENGTH : slope;
            }
        }
        if (!solve(MACHINE_COORDINATES, matrix, off)) {
            return MACHINE_SINGULAR;
        }
        double there = 0.0;
        int nearer = 0;
        /* A step that leads no nearer is shortened; near the solution that is round-off, and the end. */
        for (double share = 1.0; !nearer && share > SHORTEST_SHARE; share *= SHORTENING) {
            for (int j = 0; j < MACHINE_INPUTS; j++) {
                next[j] = at[j] + (j < MACHINE_COORDINATES ? share * off[j] : 0.0);
            }
            double trial[MACHINE_ACTUATORS], gap[MACHINE_ACTUATORS];
            there = actuators_at(next, trial) == MACHINE_OK ? actuators_off(trial, wanted, gap) : HUGE_VAL;
            nearer = there < left;
        }
        if (!nearer) {
            break;
        }
        for (int j = 0; j < MACHINE_COORDINATES; j++) {
            at[j] = next[j];
        }
        status = actuator_slopes_at(at, out);
        left = actuators_off(out, wanted, off);
    }
    if (status == MACHINE_OK && !(left <= CLOSED)) {
        status = MACHINE_NOT_CONVERGED;
    }
    for (int j = 0; j < MACHINE_COORDINATES; j++) {
        in[j] = (machine_real)at[j];
    }
    return status;
}
/* section: rest */

/* Coordinates of the state of rest, by Newton's method; NaN where there is none nearby. */
static void rest_of(const double *at, double *state)
{
    double next[STATES + 1];
    first_steps_at(at, next);
    for (int step = 0; step < STEPS_AT_REST && next[STATES] > ONE_STEP_AWAY * ONE_STEP_AWAY; step++) {
        for (int k = 0; k < STATES; k++) {
            state[k] = next[k];
        }
        step_at(at, state, next);
    }
    for (int k = 0; k < STATES; k++) {
        state[k] = next[k];
    }
}

int machine_rest(const machine_real in[], machine_real displacement[6])
{
    double at[MACHINE_INPUTS], state[STATES], out[6];
    take(in, at);
    rest_of(at, state);
    const int status = displacement_at(at, state, out);
    for (int k = 0; k < 6; k++) {
        displacement[k] = (machine_real)out[k];
    }
    return status;
}

/* The vector of the rotation from one orientation to another; each is three columns. */
static void rotation_between(const double *start, const double *end, double *vector)
{
    double sines[3] = {0.0, 0.0, 0.0}, cosines = -1.0;
    for (int c = 0; c < 9; c += 3) {
        sines[0] += 0.5 * (start[c + 1] * end[c + 2] - start[c + 2] * end[c + 1]);
        sines[1] += 0.5 * (start[c + 2] * end[c] - start[c] * end[c + 2]);
        sines[2] += 0.5 * (start[c] * end[c + 1] - start[c + 1] * end[c]);
        cosines += start[c] * end[c] + start[c + 1] * end[c + 1] + start[c + 2] * end[c + 2];
    }
    const double sine = sqrt(sines[0] * sines[0] + sines[1] * sines[1] + sines[2] * sines[2]);
    const double stretch = sine > 1e-8 ? atan2(sine, 0.5 * cosines) / sine : 1.0;
    for (int k = 0; k < 3; k++) {
        vector[k] = stretch * sines[k];
    }
}

/* Columns of an orientation after the rotation by a vector. */
static void rotate(const double *vector, const double *columns, double *rotated)
{
    const double angle = sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
    const double first = angle > 1e-8 ? sin(angle) / angle : 1.0;
    const double half = angle > 1e-8 ? sin(0.5 * angle) / (0.5 * angle) : 1.0;
    const double second = 0.5 * half * half;
    for (int c = 0; c < 9; c += 3) {
        const double *a = columns + c;
        const double once[3] = {vector[1] * a[2] - vector[2] * a[1], vector[2] * a[0] - vector[0] * a[2],
                                vector[0] * a[1] - vector[1] * a[0]};
        const double twice[3] = {vector[1] * once[2] - vector[2] * once[1], vector[2] * once[0] - vector[0] * once[2],
                                 vector[0] * once[1] - vector[1] * once[0]};
        for (int k = 0; k < 3; k++) {
            rotated[c + k] = a[k] + first * once[k] + second * twice[k];
        }
    }
}

/* Point and columns of the orientation of the loaded tool. */
static int loaded_place(const double *at, double *loaded)
{
    double out[MACHINE_ACTUATORS + 12 * (1 + MACHINE_INPUTS)], state[STATES], moved[6];
    int status = placement_at(at, out);
    if (status != MACHINE_OK) {
        return status;
    }
    rest_of(at, state);
    status = displacement_at(at, state, moved);
    for (int k = 0; k < 3; k++) {
        loaded[k] = out[MACHINE_ACTUATORS + k] + moved[3 + k];
    }
    rotate(moved, out + MACHINE_ACTUATORS + 3, loaded + 3);
    return status;
}

/* Motion of the loaded tool by each coordinate, from central differences: turns times LENGTH, then displacements. */
static int loaded_rates(const double *at, double *rates)
{
    for (int j = 0; j < MACHINE_COORDINATES; j++) {
        const double aside = IS_ANGLE[j] ? ASIDE : ASIDE * LENGTH;
        double next[MACHINE_INPUTS], ends[2][12], turn[3];
        for (int end = 0; end < 2; end++) {
            for (int k = 0; k < MACHINE_INPUTS; k++) {
                next[k] = at[k];
            }
            next[j] += end ? aside : -aside;
            const int status = loaded_place(next, ends[end]);
            if (status != MACHINE_OK) {
                return status;
            }
        }
        rotation_between(ends[0] + 3, ends[1] + 3, turn);
        for (int k = 0; k < 3; k++) {
            rates[k * MACHINE_COORDINATES + j] = LENGTH * turn[k] / (2.0 * aside);
            rates[(3 + k) * MACHINE_COORDINATES + j] = (ends[1][k] - ends[0][k]) / (2.0 * aside);
        }
    }
    return MACHINE_OK;
}

/* The same of the tool without loads, from the slopes of its place: point, then columns of the orientation. */
static void free_rates(const double *place, const double *slopes, double *rates)
{
    for (int j = 0; j < MACHINE_COORDINATES; j++) {
        for (int axis = 0; axis < 3; axis++) {
            const int next = (axis + 1) % 3, last = (axis + 2) % 3;
            double turn = 0.0;
            for (int c = 3; c < 12; c += 3) {
                turn += 0.5 * place[c + next] * slopes[(c + last) * MACHINE_INPUTS + j];
                turn -= 0.5 * place[c + last] * slopes[(c + next) * MACHINE_INPUTS + j];
            }
            rates[axis * MACHINE_COORDINATES + j] = LENGTH * turn;
            rates[(3 + axis) * MACHINE_COORDINATES + j] = slopes[axis * MACHINE_INPUTS + j];
        }
    }
}

int machine_command(const machine_real in[], machine_real coordinates[])
{
    double wanted[12], loaded[12], at[MACHINE_INPUTS], out[MACHINE_ACTUATORS + 12 * (1 + MACHINE_INPUTS)], off[6];
    double rates[6 * MACHINE_COORDINATES], square[MACHINE_COORDINATES * MACHINE_COORDINATES];
    double change[MACHINE_COORDINATES];
    const double *place = out + MACHINE_ACTUATORS, *slopes = place + 12;
    take(in, at);
    for (int k = 0; k < MACHINE_ACTUATORS; k++) {
        coordinates[k] = (machine_real)NAN;
    }
    int status = placement_at(at, out);
    /* Where six coordinates bring the tool to its place exactly, any rates do; the nearest place depends on them. */
    int sloped = MACHINE_COORDINATES == 6;
    for (int k = 0; k < 12; k++) {
        wanted[k] = place[k];
    }
    for (int step = 0; step < STEPS_OF_COMMAND && status == MACHINE_OK; step++) {
        status = loaded_place(at, loaded);
        if (status != MACHINE_OK) {
            return status;
        }
        rotation_between(loaded + 3, wanted + 3, off);
        for (int k = 0; k < 3; k++) {
            off[k] *= LENGTH;
            off[3 + k] = wanted[k] - loaded[k];
        }
        if (MACHINE_COORDINATES == 6 || !sloped) {
            free_rates(place, slopes, rates);
        }
        for (int i = 0; i < MACHINE_COORDINATES; i++) {
            change[i] = 0.0;
            for (int k = 0; k < 6; k++) {
                change[i] += rates[k * MACHINE_COORDINATES + i] * off[k];
            }
            for (int j = 0; j < MACHINE_COORDINATES; j++) {
                square[i * MACHINE_COORDINATES + j] = 0.0;
                for (int k = 0; k < 6; k++) {
                    square[i * MACHINE_COORDINATES + j] +=
                        rates[k * MACHINE_COORDINATES + i] * rates[k * MACHINE_COORDINATES + j];
                }
            }
        }
        if (!solve(MACHINE_COORDINATES, square, change)) {
            return MACHINE_SINGULAR;
        }
        double largest = 0.0;
        for (int j = 0; j < MACHINE_COORDINATES; j++) {
            at[j] += change[j];
            largest = fmax(largest, IS_ANGLE[j] ? fabs(change[j]) : fabs(change[j]) / LENGTH);
        }
        status = placement_at(at, out);
        if (status == MACHINE_OK && sloped && largest <= COMMANDED) {
            for (int k = 0; k < MACHINE_ACTUATORS; k++) {
                coordinates[k] = (machine_real)out[k];
            }
            return MACHINE_OK;
        }
        if (status == MACHINE_OK && !sloped && largest <= NEARLY_COMMANDED) {
            status = loaded_rates(at, rates);
            sloped = 1;
        }
    }
    return status == MACHINE_OK ? MACHINE_NOT_CONVERGED : status;
}
/* section: modes */

enum { TRIANGLE = SPRINGS * (SPRINGS + 1) / 2, PARTS = (3 * WAYS + 2 * CONDITIONS) * SPRINGS + 2 * TRIANGLE };
typedef double square_of_springs[SPRINGS][SPRINGS];

static void transpose(square_of_springs matrix)
{
    for (int i = 0; i < SPRINGS; i++) {
        for (int j = 0; j < i; j++) {
            const double kept = matrix[i][j];
            matrix[i][j] = matrix[j][i];
            matrix[j][i] = kept;
        }
    }
}

/* A symmetric matrix over the springs without what would open a leg. It is T^T H + H^T T and its upper triangle D. */
static void over_closed(const double *parts, const double *mixed, const double *upper, square_of_springs matrix)
{
    const double *closing = parts + 3 * WAYS * SPRINGS, *back = closing + CONDITIONS * SPRINGS;
    for (int i = 0; i < SPRINGS; i++) {
        for (int j = i; j < SPRINGS; j++) {
            double sum = *upper++;
            for (int k = 0; mixed && k < WAYS * SPRINGS; k += SPRINGS) {
                sum += parts[k + i] * mixed[k + j] + mixed[k + i] * parts[k + j];
            }
            matrix[i][j] = matrix[j][i] = sum;
        }
    }
    for (int side = 0; side < 2; side++) {
        for (int i = 0; i < SPRINGS; i++) {
            for (int c = 0; c < CONDITIONS; c++) {
                double share = 0.0;
                for (int j = 0; j < SPRINGS; j++) {
                    share += matrix[i][j] * back[j * CONDITIONS + c];
                }
                for (int j = 0; j < SPRINGS; j++) {
                    matrix[i][j] -= share * closing[c * SPRINGS + j];
                }
            }
        }
        transpose(matrix);
    }
}

/* Jacobi's rotations: leaves the eigenvalues on the diagonal, and eigenvectors as rows of `axes`. */
static void rotate_to_axes(square_of_springs matrix, square_of_springs axes)
{
    double whole = 0.0;
    for (int i = 0; i < SPRINGS; i++) {
        for (int j = 0; j < SPRINGS; j++) {
            axes[i][j] = i == j;
            whole += matrix[i][j] * matrix[i][j];
        }
    }
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        double beside = 0.0;
        for (int p = 0; p < SPRINGS; p++) {
            for (int q = p + 1; q < SPRINGS; q++) {
                beside += matrix[p][q] * matrix[p][q];
                if (matrix[p][q] == 0.0) {
                    continue;
                }
                const double apart = matrix[q][q] - matrix[p][p], coupling = matrix[p][q];
                const double size = fabs(apart) + sqrt(apart * apart + 4.0 * coupling * coupling);
                const double tangent = (apart < 0.0 ? -2.0 : 2.0) * coupling / size;
                const double cosine = 1.0 / sqrt(1.0 + tangent * tangent), sine = tangent * cosine;
                for (int k = 0; k < SPRINGS; k++) {
                    const double a = matrix[p][k], b = matrix[q][k], c = axes[p][k], d = axes[q][k];
                    matrix[p][k] = cosine * a - sine * b;
                    matrix[q][k] = sine * a + cosine * b;
                    axes[p][k] = cosine * c - sine * d;
                    axes[q][k] = sine * c + cosine * d;
                }
                for (int k = 0; k < SPRINGS; k++) {
                    const double a = matrix[k][p], b = matrix[k][q];
                    matrix[k][p] = cosine * a - sine * b;
                    matrix[k][q] = sine * a + cosine * b;
                }
            }
        }
        if (!(beside > 1e-32 * whole)) {
            break;
        }
    }
}

/* Modes of springs in which the least stiffness, or the most mass for it, takes part; NaN where nothing holds them. */
static void modes_of(const double *parts, int massive, int count, double *modes)
{
    square_of_springs stiff, heavy, axes;
    const double *twists = parts, *pushed = twists + WAYS * SPRINGS, *turned = pushed + WAYS * SPRINGS;
    const double *masses = parts + PARTS - 2 * TRIANGLE, *stiffness = masses + TRIANGLE;
    double ones[TRIANGLE];
    for (int i = 0, entry = 0; i < SPRINGS; i++) {
        for (int j = i; j < SPRINGS; j++) {
            ones[entry++] = i == j;
        }
    }
    over_closed(parts, turned, stiffness, stiff);
    over_closed(parts, massive ? pushed : 0, massive ? masses : ones, heavy);
    for (int i = 0; i < SPRINGS; i++) {
        stiff[i][i] += 1.0;
    }
    for (int i = 0; i < SPRINGS; i++) {
        for (int j = 0; j <= i; j++) {
            for (int k = 0; k < j; k++) {
                stiff[i][j] -= stiff[i][k] * stiff[j][k];
            }
            if (j < i) {
                stiff[i][j] /= stiff[j][j];
            }
        }
        if (!(stiff[i][i] > 0.0)) {
            for (int k = 0; k < count * SPRINGS; k++) {
                modes[k] = NAN;
            }
            return;
        }
        stiff[i][i] = sqrt(stiff[i][i]);
    }
    /* With the factor L of the stiffness: rows times its inverse, twice. */
    for (int side = 0; side < 2; side++) {
        for (int i = 0; i < SPRINGS; i++) {
            for (int j = 0; j < SPRINGS; j++) {
                for (int k = 0; k < j; k++) {
                    heavy[i][j] -= heavy[i][k] * stiff[j][k];
                }
                heavy[i][j] /= stiff[j][j];
            }
        }
        transpose(heavy);
    }
    rotate_to_axes(heavy, axes);
    for (int n = 0; n < count; n++, modes += SPRINGS) {
        int most = 0;
        for (int i = 1; i < SPRINGS; i++) {
            most = heavy[i][i] > heavy[most][most] ? i : most;
        }
        heavy[most][most] = -HUGE_VAL;
        for (int i = SPRINGS - 1; i >= 0; i--) {
            modes[i] = axes[most][i];
            for (int k = i + 1; k < SPRINGS; k++) {
                modes[i] -= stiff[k][i] * modes[k];
            }
            modes[i] /= stiff[i][i];
        }
    }
}
/* section: quantities */

int machine_quantities(const machine_real in[], machine_real quantities[], machine_real *slopes)
{
    double at[MACHINE_INPUTS], out[MACHINE_QUANTITIES * (1 + MACHINE_INPUTS)];
    take(in, at);
    $rest_first
    const int status = slopes ? quantity_slopes_at(at, ${state}out) : quantities_at(at, ${state}out);
    for (int k = 0; k < MACHINE_QUANTITIES; k++) {
        quantities[k] = (machine_real)out[k];
    }
    for (int k = 0; slopes && k < MACHINE_QUANTITIES * MACHINE_INPUTS; k++) {
        slopes[k] = isfinite(out[k / MACHINE_INPUTS]) ? (machine_real)out[MACHINE_QUANTITIES + k] : (machine_real)NAN;
    }
    return status;
}
