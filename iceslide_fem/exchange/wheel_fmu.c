/* Friction of a wheel on ice over speed and slip: bilinear between the places of a table.
   FMI 2.0 for co-simulation, in C99, without other files. Outside the table and for numbers that
   are not finite every call that computes fails with fmi2Error. */

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef char fmi2Char, fmi2Byte;
typedef const fmi2Char *fmi2String;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef int fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String,
                                   fmi2String, ...);
typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

#define API __attribute__((visibility("default")))
#define UNUSED(x) (void)(x)
#define GUID "@GUID@"

enum { SPEEDS = @SPEEDS@, SLIPS = @SLIPS@, INPUTS = 3, VARIABLES = 5 };
static const double V[SPEEDS] = @V@;
static const double S[SLIPS] = @S@;
static const double MU[SPEEDS * SLIPS] = @MU@;

typedef struct {
    double value[VARIABLES]; /* speed (m/s), slip, load (N), mu, force (N) */
    char name[256];
    const fmi2CallbackFunctions *callbacks;
} Wheel;

static size_t below(const double *axis, size_t n, double x) {
    size_t low = 0, high = n - 1;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (axis[middle] <= x) low = middle; else high = middle;
    }
    return low;
}

static fmi2Status fault(Wheel *wheel, const char *text) {
    const fmi2CallbackFunctions *of = wheel->callbacks;
    if (of && of->logger)
        of->logger(of->componentEnvironment, wheel->name, fmi2Error, "error", "%s", text);
    return fmi2Error;
}

static fmi2Status compute(Wheel *wheel) {
    const double v = wheel->value[0], s = wheel->value[1], load = wheel->value[2];
    if (!(v >= V[0] && v <= V[SPEEDS - 1])) return fault(wheel, "speed_m_s is outside the table");
    if (!(s >= 0.0 && s <= 1.0)) return fault(wheel, "slip is not from 0 to 1");
    if (!(load >= 0.0 && isfinite(load))) return fault(wheel, "load_N is not 0 or more");
    const size_t i = below(V, SPEEDS, v), j = below(S, SLIPS, s);
    const double a = (v - V[i]) / (V[i + 1] - V[i]), b = (s - S[j]) / (S[j + 1] - S[j]);
    const double *first = MU + i * SLIPS + j, *second = first + SLIPS;
    const double mu =
        (1.0 - a) * ((1.0 - b) * first[0] + b * first[1]) + a * ((1.0 - b) * second[0] + b * second[1]);
    wheel->value[3] = mu;
    wheel->value[4] = mu * load;
    return fmi2OK;
}

API const char *fmi2GetTypesPlatform(void) { return "default"; }
API const char *fmi2GetVersion(void) { return "2.0"; }

API fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                                  fmi2String resources, const fmi2CallbackFunctions *callbacks,
                                  fmi2Boolean visible, fmi2Boolean logging) {
    UNUSED(resources); UNUSED(visible); UNUSED(logging);
    if (type != fmi2CoSimulation || !guid || strcmp(guid, GUID) != 0) return NULL;
    Wheel *wheel = calloc(1, sizeof(Wheel));
    if (!wheel) return NULL;
    snprintf(wheel->name, sizeof(wheel->name), "%s", name ? name : "");
    wheel->callbacks = callbacks;
    wheel->value[0] = V[0];
    return wheel;
}

API void fmi2FreeInstance(fmi2Component c) { free(c); }

API fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String k[]) {
    UNUSED(c); UNUSED(on); UNUSED(n); UNUSED(k);
    return fmi2OK;
}

API fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_given, fmi2Real tolerance,
                                   fmi2Real start, fmi2Boolean stop_given, fmi2Real stop) {
    UNUSED(c); UNUSED(tolerance_given); UNUSED(tolerance); UNUSED(start); UNUSED(stop_given);
    UNUSED(stop);
    return fmi2OK;
}

API fmi2Status fmi2EnterInitializationMode(fmi2Component c) { UNUSED(c); return fmi2OK; }
API fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return compute(c); }
API fmi2Status fmi2Terminate(fmi2Component c) { UNUSED(c); return fmi2OK; }

API fmi2Status fmi2Reset(fmi2Component c) {
    Wheel *wheel = c;
    memset(wheel->value, 0, sizeof(wheel->value));
    wheel->value[0] = V[0];
    return fmi2OK;
}

API fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real out[]) {
    Wheel *wheel = c;
    int computed = 0;
    for (size_t k = 0; k < n; k++) {
        if (r[k] >= VARIABLES) return fault(wheel, "no such variable");
        if (r[k] >= INPUTS && !computed++ && compute(wheel) != fmi2OK) return fmi2Error;
        out[k] = wheel->value[r[k]];
    }
    return fmi2OK;
}

API fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n,
                           const fmi2Real in[]) {
    Wheel *wheel = c;
    for (size_t k = 0; k < n; k++) {
        if (r[k] >= INPUTS) return fault(wheel, "only inputs can be set");
        if (!isfinite(in[k])) return fault(wheel, "an input is not a finite number");
        wheel->value[r[k]] = in[k];
    }
    return fmi2OK;
}

API fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real step, fmi2Boolean no_return) {
    UNUSED(now); UNUSED(step); UNUSED(no_return);
    return compute(c);
}

/* Required by FMI 2.0; the unit has no variables of other kinds, no state and no derivatives. */
#define REFUSED(name, arguments) \
    API fmi2Status name arguments { return fmi2Error; }
#define NONE(name, type) \
    API fmi2Status name(fmi2Component c, const fmi2ValueReference r[], size_t n, type v[]) { \
        UNUSED(c); UNUSED(r); UNUSED(v); \
        return n ? fmi2Error : fmi2OK; \
    }
NONE(fmi2GetInteger, fmi2Integer)
NONE(fmi2GetBoolean, fmi2Boolean)
NONE(fmi2GetString, fmi2String)
NONE(fmi2SetInteger, const fmi2Integer)
NONE(fmi2SetBoolean, const fmi2Boolean)
NONE(fmi2SetString, const fmi2String)
REFUSED(fmi2GetFMUstate, (fmi2Component c, fmi2FMUstate *s) )
REFUSED(fmi2SetFMUstate, (fmi2Component c, fmi2FMUstate s))
REFUSED(fmi2FreeFMUstate, (fmi2Component c, fmi2FMUstate *s))
REFUSED(fmi2SerializedFMUstateSize, (fmi2Component c, fmi2FMUstate s, size_t *n))
REFUSED(fmi2SerializeFMUstate, (fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n))
REFUSED(fmi2DeSerializeFMUstate, (fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s))
REFUSED(fmi2GetDirectionalDerivative,
        (fmi2Component c, const fmi2ValueReference u[], size_t nu, const fmi2ValueReference k[],
         size_t nk, const fmi2Real dk[], fmi2Real du[]))
REFUSED(fmi2SetRealInputDerivatives,
        (fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer o[],
         const fmi2Real v[]))
REFUSED(fmi2GetRealOutputDerivatives,
        (fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer o[],
         fmi2Real v[]))
REFUSED(fmi2CancelStep, (fmi2Component c))
REFUSED(fmi2GetStatus, (fmi2Component c, fmi2StatusKind k, fmi2Status *s))
REFUSED(fmi2GetRealStatus, (fmi2Component c, fmi2StatusKind k, fmi2Real *s))
REFUSED(fmi2GetIntegerStatus, (fmi2Component c, fmi2StatusKind k, fmi2Integer *s))
REFUSED(fmi2GetBooleanStatus, (fmi2Component c, fmi2StatusKind k, fmi2Boolean *s))
REFUSED(fmi2GetStringStatus, (fmi2Component c, fmi2StatusKind k, fmi2String *s))
