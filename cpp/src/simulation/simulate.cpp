#include "stepdiag/simulation/simulate.hpp"

#include <cmath>
#include <sstream>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random.hpp"

namespace stepdiag {
namespace {

void check_options(const Plan& plan, const SimulationOptions& options) {
    for (const auto& [line, misalignment] : options.misalignment) {
        if (!plan.contains(Line::parse(line)))
            throw InvalidArgument("misalignment: line \"" + line + "\" is not in the plan");
        const auto small = [](const Eigen::Vector2d& angles) {
            return angles.allFinite() && angles.cwiseAbs().maxCoeff() < 0.1;
        };
        if (!small(misalignment.reflector) || !small(misalignment.laser) || !misalignment.psd_zero.allFinite())
            throw InvalidArgument("misalignment of " + line + ": expected angles below 0.1 rad and finite lengths");
    }
    check_noise(options.noise);
    if (!(std::isfinite(options.ambient.index) && options.ambient.index >= 1.0))
        throw InvalidArgument("refractive_index: expected a finite value of at least 1");
}

Eigen::Vector2d mirror_size(const Head& head, const Plan& plan) {
    const Eigen::Vector2d smallest = plan.smallest_mirror();
    if (!head.mirror) return smallest + Eigen::Vector2d::Constant(2.0 * Head::mirror_margin);
    if ((*head.mirror - smallest).minCoeff() < 0.0) {
        std::ostringstream text;
        text << "head mirror: too small for this plan: expected at least " << smallest.x() << " x " << smallest.y()
             << " mm, got " << head.mirror->x() << " x " << head.mirror->y() << " mm";
        throw InvalidArgument(text.str());
    }
    return *head.mirror;
}

double deviation(const Noise& noise, const std::string& channel) {
    if (channel == "alpha" || channel == "beta") return noise.tilt;
    return channel == "spot_x" || channel == "spot_y" ? noise.spot : noise.distance;
}

}  // namespace

void check_noise(const Noise& noise) {
    for (const auto& [key, deviation] :
         {std::pair("distance", noise.distance), std::pair("tilt", noise.tilt), std::pair("spot", noise.spot)})
        if (!(std::isfinite(deviation) && deviation >= 0.0))
            throw InvalidArgument(std::string("noise ") + key + ": expected a finite standard deviation, at least 0");
}

Measurement simulate(const Machine& machine, const Plan& plan, const Head& head, const SimulationOptions& options) {
    check_head(head);
    check_options(plan, options);
    const Eigen::Vector2d mirror = mirror_size(head, plan);

    std::vector<Station> stations;
    std::vector<Channel> channels;
    for (const std::string& name : signal_names(head)) channels.push_back({name, {}});

    std::vector<Line> lines = plan.lines();
    lines.insert(lines.end(), plan.scale_lines().begin(), plan.scale_lines().end());
    for (const Line& line : lines) {
        const auto points = plan.points(line);
        const auto misalignment = options.misalignment.find(line.name());
        const HeadSetup setup =
            set_up(head, plan.frame(line), points.front().commanded + machine.tool(), mirror,
                   misalignment == options.misalignment.end() ? Misalignment{} : misalignment->second);
        for (std::size_t k = 0; k < points.size(); ++k) {
            const Pose pose = machine.pose(points[k].commanded);
            const auto reading = head.layout == HeadLayout::ideal
                                     ? trace_reading(head, setup, pose.position, pose.rotation, options.ambient)
                                     : define_reading(setup, pose.position, pose.rotation);
            const std::uint64_t row = stations.size();
            stations.push_back({0, line, int(k), Direction::forward, points[k].commanded});
            Eigen::VectorXd values;
            if (reading) values = signals(head, setup, *reading);
            for (std::size_t c = 0; c < channels.size(); ++c) {
                std::optional<double> value;
                if (reading) {
                    value = values[Eigen::Index(c)];
                    if (const double sigma = deviation(options.noise, channels[c].name); sigma > 0.0)
                        *value +=
                            sigma * normal_pair(options.noise.seed, RandomStream::reading_noise, (row << 16) | c)[0];
                }
                channels[c].value.push_back(value);
            }
        }
    }
    return Measurement(std::move(stations), std::move(channels));
}

}  // namespace stepdiag
