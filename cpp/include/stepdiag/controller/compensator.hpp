// Volumetric compensation for a controller. A compensator is made from a calibration file. For any position it gives
// the error of the machine and the compensated command.
//   forward(c) = c + e(c)                  position of the tool if the axes are at c
//   command(t) = c with c + e(c) = t       axis positions that bring the tool to t; bounded iteration c <- t - e(c)
// e(c) is the error of the functional point: its exact pose (CONVENTIONS, machine.hpp) minus its nominal position, for
// the tool offset of the call. Functions are interpolated linearly between the nodes of the table. Positions are axis
// positions in the controller's machine coordinates, mm; `origin` gives these coordinates of home, the corner of the
// calibrated volume. Angles in rad.
//
// A call may state the temperatures of the scales of X, Y, Z, degrees Celsius. e(c) then has the scales' expansion
// (machine/expansion.hpp) in it, inside the chain: the table's expansion_per_k and fixed_point_mm, from its
// temperature_reference_c on. Without them e(c) is that of the table. The coefficients are the table's own and no
// option: its positioning errors were referred to the reference with them, and any others would be wrong where it was
// measured.
//
// Loading allocates memory and may throw. All other functions are noexcept, take a bounded time, do not allocate, lock
// or make system calls, and may be called from several threads concurrently. compensator.h is the interface for C.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace stepdiag {

struct CompensatorTables;
struct ParameterTable;

// Behaviour outside the calibrated volume. The test uses the position for an error, the target for a command, and the
// result for a forward. The three therefore agree although command and target differ. A position up to 1e-6 mm beyond
// the edge counts as inside.
enum class Outside {
    hold,    // use the error of the nearest point of the volume
    linear,  // extrapolate functions and squareness terms from the last interval up to `margin`; refuse beyond it
    refuse   // refuse the request (compensation_refused)
};

// The direction of approach to compensate, for a table with reversal. The compensator does not know the motion.
enum class CompensatedApproach { mean, positive, negative };

struct CompensatorOptions {
    std::array<double, 3> origin = {0.0, 0.0, 0.0};  // home in the controller's coordinates, mm
    Outside outside = Outside::hold;
    double margin = 0.0;              // for Outside::linear, mm; at most the volume's shortest edge
    double largest_correction = 1.0;  // mm; command and forward shorten longer error vectors to this length
    CompensatedApproach approach = CompensatedApproach::mean;
    double largest_tool = 1000.0;    // mm; longer tools are refused; inverse_bound() is valid for all shorter tools
    bool accept_rejected = false;    // accept a table whose fit was rejected
    bool accept_unverified = false;  // accept a calibration that was read without a checksum, now or earlier
    // Lowest and highest temperature of a scale that calls may state, degrees Celsius; both 0: none may be stated.
    std::array<double, 2> temperatures = {0.0, 0.0};
};

// Flags. 0: the position is inside the volume.
enum CompensationStatus : unsigned {
    compensation_outside = 1,  // outside the volume: held, extrapolated or refused
    compensation_capped = 2,   // the error exceeds largest_correction; corrections are shortened
    compensation_refused = 4,  // refused: outside with Outside::refuse, beyond the margin, a position that is not
                               // finite or farther than 100 m, or a tool longer than largest_tool. The function returns
                               // the given position or an error of 0. The machine must not move.
    compensation_temperature = 16  // with `refused`: a temperature that is not finite or outside CompensatorOptions::
                                   // temperatures. (8 is a flag of the LinuxCNC module.)
};

struct MachineError {
    std::array<double, 3> position;     // e, mm; not shortened to largest_correction
    std::array<double, 3> orientation;  // rotation vector of the tool, rad
    unsigned status;
};

struct CompensatedPosition {
    std::array<double, 3> position;  // mm, controller's coordinates
    unsigned status;
};

class Compensator {
public:
    // Reads a calibration or error map. `chain` is the kinematic chain of the controller's machine. Throws
    // InvalidArgument, which names file, line and key, for:
    //   - a file that read_parameter_table() rejects
    //   - a table whose fit was rejected, unless accept_rejected is set
    //   - a calibration whose checksum is absent, or was when it was read earlier (unverified_key), unless
    //     accept_unverified is set
    //   - a table without chain, volume_mm or tool_mm, or with a chain other than `chain`
    //   - a table without parameters, or with nodes that do not match its volume
    //   - errors with slopes so large that the inverse has no bound
    //   - a table as found, or without its expansion, if options.temperatures are stated
    //   - options out of range
    static Compensator load(const std::string& path, const std::string& chain, const CompensatorOptions& options = {});
    // The same for a table in memory. Messages call it `name`.
    Compensator(const ParameterTable& table, const std::string& name, const std::string& chain,
                const CompensatorOptions& options = {});
    ~Compensator();
    Compensator(Compensator&&) noexcept;
    Compensator& operator=(Compensator&&) noexcept;

    // `tool`: offset of the functional point from the tool's origin, mm. `temperature`: of the scales of X, Y, Z.
    MachineError error(const std::array<double, 3>& position, const std::array<double, 3>& tool) const noexcept;
    CompensatedPosition command(const std::array<double, 3>& target, const std::array<double, 3>& tool) const noexcept;
    CompensatedPosition forward(const std::array<double, 3>& command, const std::array<double, 3>& tool) const noexcept;
    MachineError error(const std::array<double, 3>& position, const std::array<double, 3>& tool,
                       const std::array<double, 3>& temperature) const noexcept;
    CompensatedPosition command(const std::array<double, 3>& target, const std::array<double, 3>& tool,
                                const std::array<double, 3>& temperature) const noexcept;
    CompensatedPosition forward(const std::array<double, 3>& command, const std::array<double, 3>& tool,
                                const std::array<double, 3>& temperature) const noexcept;

    // The same with arrays of three numbers, as in C. They return the status. Input and output may be the same array. A
    // null `tool` means the tool of the calibration, a null `temperature` that none is stated. A null `orientation` is
    // not computed, which saves a third of the time.
    unsigned error(const double* position, const double* tool, double* error, double* orientation) const noexcept;
    unsigned command(const double* target, const double* tool, double* command) const noexcept;
    unsigned forward(const double* command, const double* tool, double* actual) const noexcept;
    unsigned error(const double* position, const double* tool, const double* temperature, double* error,
                   double* orientation) const noexcept;
    unsigned command(const double* target, const double* tool, const double* temperature,
                     double* command) const noexcept;
    unsigned forward(const double* command, const double* tool, const double* temperature,
                     double* actual) const noexcept;

    // The same for many positions at once, `count` rows (x, y, z): four at a time where the processor has AVX2. Errors
    // and orientations differ from those of single calls by at most 1e-15 mm and 1e-18 rad, commands meet the same
    // bound. `orientations` and `statuses` may be null. Returns the flags of all statuses: 0 if each of them is 0.
    unsigned errors(std::size_t count, const double* positions, const double* tool, const double* temperature,
                    double* errors, double* orientations, unsigned* statuses) const noexcept;
    unsigned commands(std::size_t count, const double* targets, const double* tool, const double* temperature,
                      double* commands, unsigned* statuses) const noexcept;

    // Hash that identifies the corrections of the table: chain, volume, tool, nodes and values, and its expansion if it
    // has one. It does not depend on the spelling and order of the file, on options, uncertainties, method and date.
    std::uint64_t fingerprint() const noexcept;
    // Upper bound of |forward(command(t)) - t|, mm, for all targets, tools, temperatures and options.
    double inverse_bound() const noexcept;
    std::array<double, 3> volume() const noexcept;  // mm
    std::array<double, 3> tool() const noexcept;    // of the calibration, mm
    // Temperature at which its scales add nothing, degrees Celsius; NaN unless options.temperatures are stated.
    double temperature_reference() const noexcept;
    // Verdict of the table's fit: "accepted", "doubtful", "rejected" or "unchecked"; empty if the table has none. Warn
    // the user about a doubtful or unchecked table.
    const std::string& fit() const noexcept;
    // Whether the table is unverified: nothing tells whether its values are those that were written. Warn the user.
    bool is_unverified() const noexcept;
    // Parameters that the table does not determine. They are not compensated. Examples: "EXX", "EYX (slope)",
    // "EXX (above 784.0 mm)", "C0Y".
    const std::vector<std::string>& uncompensated() const noexcept;

private:
    std::unique_ptr<const CompensatorTables> tables_;
};

}  // namespace stepdiag
