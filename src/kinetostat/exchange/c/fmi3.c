/* section: always */
$note
/* The machine as a model of FMI 3.0, for model exchange and co-simulation. It has no states: outputs follow inputs. */
#include "@stem@.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void (*logger)(void *, fmi3Status, const char *, const char *);

#define TOKEN "$token"
enum { STATUSES = $statuses, NUMBERS = $numbers };
/* section: forward */
enum { DRIVEN = $driven, REACHED = $reached, REACHED_STATUS = 1 };
/* section: always */
enum { INPUT = $first_input, STIFFNESS = $stiffness, COMPLIANCE = $compliance, COORDINATES = $coordinates };
/* section: rest */
enum { DISPLACEMENT = $displacement, COMMAND = $command };
/* section: quantities */
enum { QUANTITIES = $quantity };
/* section: always */

/* Numbers by value reference: where they begin, how many they are, and whether they can be set. Value references of
   statuses come after them. */
static const struct {
    int first, count, given;
} VARIABLES[] = {
$variables};
enum { VARIABLE_COUNT = sizeof VARIABLES / sizeof VARIABLES[0] };
static const double START[NUMBERS] = {$start};

typedef struct {
    double numbers[NUMBERS];
    int32_t status[STATUSES];
    bool stale;
} instance;

static void update(instance *it)
{
    if (!it->stale) {
        return;
    }
    double *n = it->numbers;
    it->stale = false;
    it->status[0] = machine_matrices(n + INPUT, n + STIFFNESS, n + COMPLIANCE);
    machine_actuators(n + INPUT, n + COORDINATES, NULL);
/* section: rest */
    machine_rest(n + INPUT, n + DISPLACEMENT);
    machine_command(n + INPUT, n + COMMAND);
/* section: quantities */
    machine_quantities(n + INPUT, n + QUANTITIES, NULL);
/* section: forward */
    /* From the pose that was reached before, or from the pose of the inputs where that led nowhere. */
    double pose[MACHINE_INPUTS];
    const double *starts[2] = {n + REACHED, n + INPUT};
    for (int attempt = 0; attempt < 2; attempt++) {
        for (int k = 0; k < MACHINE_INPUTS; k++) {
            pose[k] = k < MACHINE_COORDINATES ? starts[attempt][k] : n[INPUT + k];
        }
        it->status[REACHED_STATUS] = machine_forward(n + DRIVEN, pose);
        if (it->status[REACHED_STATUS] == MACHINE_OK) {
            break;
        }
    }
    for (int k = 0; k < MACHINE_COORDINATES; k++) {
        n[REACHED + k] = it->status[REACHED_STATUS] == MACHINE_OK ? pose[k] : NAN;
    }
/* section: always */
}

static void restart(instance *it)
{
    memcpy(it->numbers, START, sizeof START);
    it->stale = true;
}

EXPORTED const char *fmi3GetVersion(void)
{
    return "3.0";
}

static void *instantiate(const char *token, void *environment, logger log)
{
    if (!token || strcmp(token, TOKEN)) {
        if (log) {
            log(environment, fmi3Error, "error", "The token is not that of this model; its files are of two models.");
        }
        return NULL;
    }
    instance *it = calloc(1, sizeof(instance));
    if (it) {
        restart(it);
    }
    return it;
}

EXPORTED void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *path, bool visible,
                                            bool logging, void *environment, logger log)
{
    (void)name, (void)path, (void)visible, (void)logging;
    return instantiate(token, environment, log);
}

EXPORTED void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *path, bool visible,
                                           bool logging, bool events, bool early, const uint32_t references[],
                                           size_t count, void *environment, logger log, void *intermediate)
{
    (void)name, (void)path, (void)visible, (void)logging, (void)events, (void)early;
    (void)references, (void)count, (void)intermediate;
    return instantiate(token, environment, log);
}

EXPORTED void *fmi3InstantiateScheduledExecution(void)
{
    return NULL;
}

EXPORTED void fmi3FreeInstance(void *it)
{
    free(it);
}

EXPORTED fmi3Status fmi3Reset(void *it)
{
    restart(it);
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SetFloat64(void *given, const uint32_t references[], size_t count, const double values[],
                                   size_t values_count)
{
    instance *it = given;
    size_t taken = 0;
    for (size_t k = 0; k < count; k++) {
        const uint32_t reference = references[k];
        if (reference >= VARIABLE_COUNT || !VARIABLES[reference].given ||
            taken + (size_t)VARIABLES[reference].count > values_count) {
            return fmi3Error;
        }
        const size_t size = (size_t)VARIABLES[reference].count;
        memcpy(it->numbers + VARIABLES[reference].first, values + taken, size * sizeof(double));
        taken += size;
    }
    it->stale = true;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3GetFloat64(void *given, const uint32_t references[], size_t count, double values[],
                                   size_t values_count)
{
    instance *it = given;
    size_t laid = 0;
    update(it);
    for (size_t k = 0; k < count; k++) {
        const uint32_t reference = references[k];
        if (reference >= VARIABLE_COUNT || laid + (size_t)VARIABLES[reference].count > values_count) {
            return fmi3Error;
        }
        const size_t size = (size_t)VARIABLES[reference].count;
        memcpy(values + laid, it->numbers + VARIABLES[reference].first, size * sizeof(double));
        laid += size;
    }
    return fmi3OK;
}

EXPORTED fmi3Status fmi3GetInt32(void *given, const uint32_t references[], size_t count, int32_t values[],
                                 size_t values_count)
{
    instance *it = given;
    update(it);
    for (size_t k = 0; k < count; k++) {
        if (references[k] < VARIABLE_COUNT || references[k] >= VARIABLE_COUNT + STATUSES || k >= values_count) {
            return fmi3Error;
        }
        values[k] = it->status[references[k] - VARIABLE_COUNT];
    }
    return fmi3OK;
}

EXPORTED fmi3Status fmi3DoStep(void *given, double time, double step, bool no_past, bool *event, bool *terminate,
                               bool *early, double *last)
{
    (void)no_past;
    instance *it = given;
    it->numbers[0] = *last = time + step;
    *event = *terminate = *early = false;
    update(it);
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SetTime(void *given, double time)
{
    ((instance *)given)->numbers[0] = time;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3UpdateDiscreteStates(void *it, bool *again, bool *terminate, bool *nominals, bool *values,
                                             bool *event, double *next)
{
    (void)it;
    *again = *terminate = *nominals = *values = *event = false;
    *next = 0.0;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3CompletedIntegratorStep(void *it, bool no_past, bool *event, bool *terminate)
{
    (void)it, (void)no_past;
    *event = *terminate = false;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3GetNumberOfContinuousStates(void *it, size_t *count)
{
    (void)it;
    *count = 0;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3GetNumberOfEventIndicators(void *it, size_t *count)
{
    (void)it;
    *count = 0;
    return fmi3OK;
}

#define ACCEPTED(name, arguments) \
    EXPORTED fmi3Status name arguments \
    { \
        (void)it; \
        return fmi3OK; \
    }
#define STATELESS(name, type) \
    EXPORTED fmi3Status name(void *it, type values, size_t count) \
    { \
        (void)it, (void)values; \
        return count ? fmi3Error : fmi3OK; \
    }
#define REFUSED(name) \
    EXPORTED fmi3Status name(void) \
    { \
        return fmi3Error; \
    }
#define NO_VARIABLES(type) REFUSED(fmi3Get##type) REFUSED(fmi3Set##type)

EXPORTED fmi3Status fmi3EnterInitializationMode(void *given, bool known, double tolerance, double start, bool ends,
                                                double stop)
{
    (void)known, (void)tolerance, (void)ends, (void)stop;
    ((instance *)given)->numbers[0] = start;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SetDebugLogging(void *it, bool on, size_t count, const char *const categories[])
{
    (void)it, (void)on, (void)count, (void)categories;
    return fmi3OK;
}

ACCEPTED(fmi3ExitInitializationMode, (void *it))
ACCEPTED(fmi3EnterConfigurationMode, (void *it))
ACCEPTED(fmi3ExitConfigurationMode, (void *it))
ACCEPTED(fmi3EnterStepMode, (void *it))
ACCEPTED(fmi3Terminate, (void *it))
ACCEPTED(fmi3EnterEventMode, (void *it))
ACCEPTED(fmi3EnterContinuousTimeMode, (void *it))
STATELESS(fmi3SetContinuousStates, const double *)
STATELESS(fmi3GetContinuousStates, double *)
STATELESS(fmi3GetContinuousStateDerivatives, double *)
STATELESS(fmi3GetNominalsOfContinuousStates, double *)
STATELESS(fmi3GetEventIndicators, double *)
NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
REFUSED(fmi3SetInt32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)
NO_VARIABLES(Binary)
NO_VARIABLES(Clock)
NO_VARIABLES(FMUState)
REFUSED(fmi3FreeFMUState)
REFUSED(fmi3SerializedFMUStateSize)
REFUSED(fmi3SerializeFMUState)
REFUSED(fmi3DeserializeFMUState)
REFUSED(fmi3GetDirectionalDerivative)
REFUSED(fmi3GetAdjointDerivative)
REFUSED(fmi3GetOutputDerivatives)
REFUSED(fmi3GetNumberOfVariableDependencies)
REFUSED(fmi3GetVariableDependencies)
REFUSED(fmi3EvaluateDiscreteStates)
REFUSED(fmi3GetIntervalDecimal)
REFUSED(fmi3GetIntervalFraction)
REFUSED(fmi3GetShiftDecimal)
REFUSED(fmi3GetShiftFraction)
REFUSED(fmi3SetIntervalDecimal)
REFUSED(fmi3SetIntervalFraction)
REFUSED(fmi3SetShiftDecimal)
REFUSED(fmi3SetShiftFraction)
REFUSED(fmi3ActivateModelPartition)
