#include "stepdiag/controller/compensator.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "core/text_file.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/machine/machine.hpp"

namespace stepdiag {

struct Compensator::Tables {
    Machine machine;
    Eigen::Vector3d volume, tool, origin;
    CompensatorOptions options;
    std::uint64_t fingerprint;
    std::vector<std::string> uncompensated;

    MachineError error(const Eigen::Vector3d& position, const Eigen::Vector3d& tool_offset) const noexcept {
        const Eigen::Vector3d inside = position.cwiseMax(0.0).cwiseMin(volume);
        const Pose pose = machine.pose(inside);
        Eigen::Vector3d e = pose.position + pose.rotation * tool_offset - inside - tool_offset;
        const Eigen::AngleAxisd turn(pose.rotation);
        const Eigen::Vector3d orientation = turn.angle() * turn.axis();
        unsigned status = inside == position ? 0 : compensation_outside;
        if (!position.allFinite() || (status && options.outside != Outside::hold)) status = compensation_refused;
        if (e.norm() > options.largest_correction) {
            status |= compensation_capped;
            e *= options.largest_correction / e.norm();
        }
        return {{e.x(), e.y(), e.z()}, {orientation.x(), orientation.y(), orientation.z()}, status};
    }
};

namespace {

Eigen::Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
std::array<double, 3> array(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Eigen::Vector3d lengths(const ParameterTable& table, const std::string& name, const std::string& key) {
    const auto entry = table.header.find(key);
    if (entry == table.header.end())
        throw InvalidArgument(name + ": expected a leading line \"# " + key + "=\", got none");
    Eigen::Vector3d value;
    std::string rest = entry->second;
    for (int i = 0; i < 3; ++i) {
        const auto number = parse_decimal(rest.substr(0, rest.find(' ')), 0);
        if (!number)
            throw InvalidArgument(name + ": " + key + ": expected three lengths in mm, got \"" + entry->second + "\"");
        value[i] = *number;
        rest = rest.find(' ') == std::string::npos ? "" : rest.substr(rest.find(' ') + 1);
    }
    return value;
}

}  // namespace

Compensator Compensator::load(const std::string& path, const std::string& chain, const CompensatorOptions& options) {
    return Compensator(read_parameter_table(path), path, chain, options);
}

Compensator::Compensator(const ParameterTable& table, const std::string& name, const std::string& chain,
                         const CompensatorOptions& options) {
    const Chain controllers = Chain::parse(chain);
    const auto entry = table.header.find("chain");
    if (entry == table.header.end()) throw InvalidArgument(name + ": expected a leading line \"# chain=\", got none");
    const Chain own = Chain::parse(entry->second);
    if (!(own == controllers))
        throw InvalidArgument(name + ": chain: expected the controller's " + chain + ", got " + own.name());
    tables_ = std::make_unique<const Tables>(Tables{Machine(own, ErrorMap(table)),
                                                    lengths(table, name, "volume_mm"),
                                                    lengths(table, name, "tool_mm"),
                                                    vector(options.origin),
                                                    options,
                                                    0,
                                                    {}});
}

Compensator::~Compensator() = default;
Compensator::Compensator(Compensator&&) noexcept = default;
Compensator& Compensator::operator=(Compensator&&) noexcept = default;

MachineError Compensator::error(const std::array<double, 3>& position,
                                const std::array<double, 3>& tool) const noexcept {
    return tables_->error(vector(position) - tables_->origin, vector(tool));
}

CompensatedPosition Compensator::command(const std::array<double, 3>& target,
                                         const std::array<double, 3>& tool) const noexcept {
    Eigen::Vector3d command = vector(target);
    unsigned status = 0;
    for (int i = 0; i < 8; ++i) {
        const MachineError e = error(array(command), tool);
        command = vector(target) - vector(e.position);
        status = e.status;
    }
    return {array(command), status};
}

CompensatedPosition Compensator::forward(const std::array<double, 3>& command,
                                         const std::array<double, 3>& tool) const noexcept {
    const MachineError e = error(command, tool);
    return {array(vector(command) + vector(e.position)), e.status};
}

std::uint64_t Compensator::fingerprint() const noexcept { return tables_->fingerprint; }
double Compensator::inverse_bound() const noexcept { return 1e-10; }
std::array<double, 3> Compensator::volume() const noexcept { return array(tables_->volume); }
std::array<double, 3> Compensator::tool() const noexcept { return array(tables_->tool); }
const std::vector<std::string>& Compensator::uncompensated() const noexcept { return tables_->uncompensated; }

}  // namespace stepdiag
