/* FMI 3.0 for co-simulation around @NAME@. Written by Whippen. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "@NAME@.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT
#endif

/* As the standard declares them. */
typedef void *Handle;
typedef uint32_t Reference;
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status;
typedef void (*Log)(void *environment, Status status, const char *category, const char *message);

enum { INPUTS = @INPUTS@, OUTPUTS = @OUTPUTS@, LIVES = @LIVES@, ALL = 1 + INPUTS + OUTPUTS + LIVES };

/* A word of 0 and of 65535 (SI), of each input; the force of 32768 (SI), of each output. */
static const double lows[] = {@LOWS@}, highs[] = {@HIGHS@}, scales[] = {@SCALES@};
/* Live values: unit of the integer (SI), its range, its start, where it lies in the state. */
static const struct { double unit; int32_t low, high, start; size_t at; } lives[] = {@LIVE_ROWS@};

typedef struct {
    struct @NAME@_state state;
    double values[ALL];
    double start;
    uint64_t ticks;
    bool has_begun;
    Log log;
    void *environment;
} Instance;

static Status wrong(const Instance *of, const char *message)
{
    if (of != NULL && of->log != NULL) {
        of->log(of->environment, ERROR, "logStatusError", message);
    }
    return ERROR;
}

static void set_fresh(Instance *of)
{
    memset(&of->state, 0, sizeof of->state);
    memset(of->values, 0, sizeof of->values);
    for (int n = 0; n < INPUTS; n++) {
        of->values[1 + n] = lows[n] > 0 ? lows[n] : highs[n] < 0 ? highs[n] : 0;
    }
    for (int n = 0; n < LIVES; n++) {
        of->values[1 + INPUTS + OUTPUTS + n] = lives[n].start * lives[n].unit;
    }
    of->ticks = 0;
    of->has_begun = false;
}

/* What is sensed and set, as integers. */
static void take(Instance *of)
{
    for (int n = 0; n < INPUTS; n++) {
        const double word = floor((of->values[1 + n] - lows[n]) / (highs[n] - lows[n]) * 65535 + 0.5);
        of->state.inputs[0][n] = (uint16_t)(word > 0 ? word < 65535 ? word : 65535 : 0);
    }
    for (int n = 0; n < LIVES; n++) {
        const double integer = round(of->values[1 + INPUTS + OUTPUTS + n] / lives[n].unit);
        const int32_t held = integer > lives[n].low ? integer < lives[n].high ? (int32_t)integer : lives[n].high : lives[n].low;
        memcpy((char *)&of->state + lives[n].at, &held, sizeof held);
    }
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT Status fmi3SetDebugLogging(Handle instance, bool on, size_t count, const char *const *categories)
{
    (void)instance, (void)on, (void)count, (void)categories;
    return OK;
}

EXPORT Handle fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logs, bool events,
    bool early, const Reference *intermediate, size_t count, void *environment, Log log, void *update)
{
    (void)name, (void)resources, (void)visible, (void)events, (void)early, (void)intermediate, (void)count, (void)update;
    Instance *of;
    if (token == NULL || strcmp(token, "@TOKEN@") != 0) {
        if (log != NULL) {
            log(environment, ERROR, "logStatusError", "the token is that of another model");
        }
        return NULL;
    }
    of = calloc(1, sizeof *of);
    if (of != NULL) {
        of->log = logs ? log : NULL;
        of->environment = environment;
        set_fresh(of);
    }
    return of;
}

EXPORT Handle fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible, bool logs,
    void *environment, Log log)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logs, (void)environment, (void)log;
    return NULL;
}

EXPORT Handle fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *resources, bool visible, bool logs,
    void *environment, Log log, void *update, void *lock, void *unlock)
{
    (void)update, (void)lock, (void)unlock;
    return fmi3InstantiateModelExchange(name, token, resources, visible, logs, environment, log);
}

EXPORT void fmi3FreeInstance(Handle instance) { free(instance); }

EXPORT Status fmi3EnterInitializationMode(Handle instance, bool has_tolerance, double tolerance, double start, bool has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((Instance *)instance)->start = start;
    return OK;
}

EXPORT Status fmi3ExitInitializationMode(Handle instance)
{
    (void)instance;
    return OK;
}

EXPORT Status fmi3Terminate(Handle instance)
{
    (void)instance;
    return OK;
}

EXPORT Status fmi3Reset(Handle instance)
{
    set_fresh(instance);
    return OK;
}

EXPORT Status fmi3GetFloat64(Handle instance, const Reference *references, size_t count, double *values, size_t value_count)
{
    const Instance *of = instance;
    if (count != value_count) {
        return wrong(of, "as many values as variables are asked for");
    }
    for (size_t n = 0; n < count; n++) {
        if (references[n] >= ALL) {
            return wrong(of, "there is no such variable");
        }
        values[n] = of->values[references[n]];
    }
    return OK;
}

EXPORT Status fmi3SetFloat64(Handle instance, const Reference *references, size_t count, const double *values, size_t value_count)
{
    Instance *of = instance;
    if (count != value_count) {
        return wrong(of, "as many values as variables are given");
    }
    for (size_t n = 0; n < count; n++) {
        const Reference at = references[n];
        if (at == 0 || at >= ALL || (at > INPUTS && at <= INPUTS + OUTPUTS)) {
            return wrong(of, "what is set is an input or a live value");
        }
        if (!isfinite(values[n])) {
            return wrong(of, "a value is not finite");
        }
        of->values[at] = values[n];
    }
    return OK;
}

EXPORT Status fmi3DoStep(Handle instance, double now, double step, bool keeps, bool *handles, bool *ends, bool *early, double *last)
{
    Instance *of = instance;
    /* The ticks that are due by the end of the step. */
    const double due = floor((now + step - of->start) * @RATE@ + 1e-6);
    (void)keeps;
    *handles = *ends = *early = false;
    if (!(step > 0) || due < (double)of->ticks) {
        return wrong(of, "time goes forwards");
    }
    take(of);
    if (!of->has_begun) {
        @NAME@_init(&of->state);
        of->has_begun = true;
    }
    for (; (double)of->ticks < due; of->ticks++) {
        @NAME@_tick(&of->state);
    }
    for (int n = 0; n < OUTPUTS; n++) {
        of->values[1 + INPUTS + n] = of->state.outputs[0][n] / 32768.0 * scales[n];
    }
    of->values[0] = now + step;
    *last = now + step;
    return OK;
}

/* What an FMU of numbers without states and clocks does not do. */
#define REFUSE(name) \
    EXPORT Status name(Handle instance) { return wrong(instance, #name " is not supported"); }
REFUSE(fmi3EnterEventMode)
REFUSE(fmi3EnterStepMode)
REFUSE(fmi3EnterConfigurationMode)
REFUSE(fmi3ExitConfigurationMode)
REFUSE(fmi3GetFMUState)
REFUSE(fmi3SetFMUState)
REFUSE(fmi3FreeFMUState)
REFUSE(fmi3SerializedFMUStateSize)
REFUSE(fmi3SerializeFMUState)
REFUSE(fmi3DeserializeFMUState)
REFUSE(fmi3GetFloat32)
REFUSE(fmi3GetInt8)
REFUSE(fmi3GetUInt8)
REFUSE(fmi3GetInt16)
REFUSE(fmi3GetUInt16)
REFUSE(fmi3GetInt32)
REFUSE(fmi3GetUInt32)
REFUSE(fmi3GetInt64)
REFUSE(fmi3GetUInt64)
REFUSE(fmi3GetBoolean)
REFUSE(fmi3GetString)
REFUSE(fmi3GetBinary)
REFUSE(fmi3GetClock)
REFUSE(fmi3SetFloat32)
REFUSE(fmi3SetInt8)
REFUSE(fmi3SetUInt8)
REFUSE(fmi3SetInt16)
REFUSE(fmi3SetUInt16)
REFUSE(fmi3SetInt32)
REFUSE(fmi3SetUInt32)
REFUSE(fmi3SetInt64)
REFUSE(fmi3SetUInt64)
REFUSE(fmi3SetBoolean)
REFUSE(fmi3SetString)
REFUSE(fmi3SetBinary)
REFUSE(fmi3SetClock)
REFUSE(fmi3GetDirectionalDerivative)
REFUSE(fmi3GetAdjointDerivative)
REFUSE(fmi3GetOutputDerivatives)
REFUSE(fmi3GetNumberOfVariableDependencies)
REFUSE(fmi3GetVariableDependencies)
REFUSE(fmi3GetIntervalDecimal)
REFUSE(fmi3GetIntervalFraction)
REFUSE(fmi3GetShiftDecimal)
REFUSE(fmi3GetShiftFraction)
REFUSE(fmi3SetIntervalDecimal)
REFUSE(fmi3SetIntervalFraction)
REFUSE(fmi3SetShiftDecimal)
REFUSE(fmi3SetShiftFraction)
REFUSE(fmi3EvaluateDiscreteStates)
REFUSE(fmi3UpdateDiscreteStates)
REFUSE(fmi3EnterContinuousTimeMode)
REFUSE(fmi3CompletedIntegratorStep)
REFUSE(fmi3SetTime)
REFUSE(fmi3SetContinuousStates)
REFUSE(fmi3GetContinuousStateDerivatives)
REFUSE(fmi3GetEventIndicators)
REFUSE(fmi3GetContinuousStates)
REFUSE(fmi3GetNominalsOfContinuousStates)
REFUSE(fmi3GetNumberOfEventIndicators)
REFUSE(fmi3GetNumberOfContinuousStates)
REFUSE(fmi3ActivateModelPartition)
