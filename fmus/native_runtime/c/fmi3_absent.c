/* FMI 3.0 functions for what our FMUs do not have: binaries, clocks, structural parameters,
   dependencies of single elements, adjoint derivatives. The standard wants them to be there. */
#include "fmi3Functions.h"

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define ABSENT(name, ...) \
    fmi3Status name(fmi3Instance instance, __VA_ARGS__) { return fmi3Error; }
#define REFS const fmi3ValueReference refs[], size_t n

ABSENT(fmi3GetBinary, REFS, size_t sizes[], fmi3Binary values[], size_t n_values)
ABSENT(fmi3SetBinary, REFS, const size_t sizes[], const fmi3Binary values[], size_t n_values)
ABSENT(fmi3GetClock, REFS, fmi3Clock values[])
ABSENT(fmi3SetClock, REFS, const fmi3Clock values[])
ABSENT(fmi3GetNumberOfVariableDependencies, fmi3ValueReference ref, size_t *n)
ABSENT(fmi3GetVariableDependencies, fmi3ValueReference dependent, size_t elements[],
       fmi3ValueReference independents[], size_t of_independents[], fmi3DependencyKind kinds[],
       size_t n)
ABSENT(fmi3GetAdjointDerivative, REFS, const fmi3ValueReference knowns[], size_t n_knowns,
       const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
ABSENT(fmi3GetIntervalDecimal, REFS, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
ABSENT(fmi3GetIntervalFraction, REFS, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
       fmi3IntervalQualifier qualifiers[])
ABSENT(fmi3GetShiftDecimal, REFS, fmi3Float64 shifts[])
ABSENT(fmi3GetShiftFraction, REFS, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ABSENT(fmi3SetIntervalDecimal, REFS, const fmi3Float64 intervals[])
ABSENT(fmi3SetIntervalFraction, REFS, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(fmi3SetShiftDecimal, REFS, const fmi3Float64 shifts[])
ABSENT(fmi3SetShiftFraction, REFS, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(fmi3ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) { return fmi3Error; }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) { return fmi3Error; }
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) { return fmi3Error; }
