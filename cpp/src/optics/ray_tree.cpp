#include "stepdiag/optics/ray_tree.hpp"

#include <algorithm>
#include <queue>
#include <string>
#include <utility>

#include "optics/branches.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

void check(const TreeLimits& limits) {
    if (limits.most_hits < 1) throw InvalidArgument("most_hits: expected at least 1");
    if (!(limits.least_power >= 0.0 && limits.least_power <= 1.0))
        throw InvalidArgument("least_power: expected a share of 0 to 1");
    if (limits.most_segments < 1) throw InvalidArgument("most_segments: expected at least 1");
}

// Builds a ray tree.
class Growth {
public:
    Growth(const Scene& scene, const Medium& ambient, const TreeLimits& limits)
        : scene_(scene), ambient_(ambient), limits_(limits) {
        tree_.segments.reserve(32);  // enough for most heads; reallocation would cost as much as the trace
        hits_before_.reserve(32);
    }

    RayTree from(const Ray& ray) {
        add({-1, ray, ambient_.index, 1.0, {}, {}, SegmentEnd::cut}, 0);
        while (!open_.empty()) {
            const int strongest = -open_.top().second;
            open_.pop();
            follow(strongest);
        }
        return std::move(tree_);
    }

private:
    void add(Segment segment, int hits_before) {
        if (hits_before >= limits_.most_hits || segment.power < limits_.least_power) {
            tree_.cut += segment.power;
        } else {
            open_.emplace(segment.power, -int(tree_.segments.size()));
        }
        tree_.segments.push_back(std::move(segment));
        hits_before_.push_back(hits_before);
    }

    void follow(int index) {
        const Segment segment = tree_.segments[index];
        const auto hit = scene_.first_hit(segment.ray);
        if (!hit) {
            tree_.left += segment.power;
            tree_.segments[index].end = SegmentEnd::left;
            return;
        }
        const Face& face = scene_.face(hit->face);
        Branches next = branches(face, ambient_, segment.ray.direction, segment.index);
        for (auto& branch : next.onward)
            if (branch && !(branch->share > 0.0)) branch.reset();
        const int children = int(next.onward[0].has_value()) + int(next.onward[1].has_value());
        if (children > limits_.most_segments - int(tree_.segments.size())) {
            tree_.cut += segment.power;  // its end is already `cut`
            return;
        }
        tree_.segments[index].hit = hit;
        tree_.segments[index].end = children == 0 ? SegmentEnd::absorbed : SegmentEnd::goes_on;
        tree_.absorbed += next.absorbed * segment.power;
        for (const auto& branch : next.onward)
            if (branch)
                add({index,
                     {hit->point, branch->direction},
                     branch->index,
                     branch->share * segment.power,
                     {},
                     branch->event,
                     SegmentEnd::cut},
                    hits_before_[index] + 1);
    }

    const Scene& scene_;
    const Medium& ambient_;
    const TreeLimits& limits_;
    RayTree tree_;
    std::vector<int> hits_before_;                      // for each segment
    std::priority_queue<std::pair<double, int>> open_;  // power, -segment: for equal powers the earlier one comes first
};

PathEnd end_of_path(SegmentEnd end) {
    if (end == SegmentEnd::absorbed) return PathEnd::absorbed;
    return end == SegmentEnd::left ? PathEnd::missed : PathEnd::too_many_hits;
}

}  // namespace

RayTree trace_tree(const Scene& scene, const Medium& ambient, const Ray& ray, const TreeLimits& limits) {
    check(limits);
    return Growth(scene, ambient, limits).from(ray);
}

std::vector<int> RayTree::arrivals(int face) const {
    std::vector<int> found;
    for (int i = 0; i < int(segments.size()); ++i)
        if (segments[i].end == SegmentEnd::absorbed && segments[i].hit->face == face) found.push_back(i);
    std::stable_sort(found.begin(), found.end(), [&](int a, int b) { return segments[a].power > segments[b].power; });
    return found;
}

Path RayTree::path_to(int segment) const {
    if (segment < 0 || segment >= int(segments.size()))
        throw InvalidArgument("segment: expected 0 to " + std::to_string(int(segments.size()) - 1) + ", got " +
                              std::to_string(segment));
    const Segment& last = segments[segment];
    if (last.end == SegmentEnd::goes_on)
        throw InvalidArgument("segment: " + std::to_string(segment) + " goes on; its path ends with another segment");
    std::vector<int> way;
    for (int i = segment; i >= 0; i = segments[i].parent) way.push_back(i);
    std::reverse(way.begin(), way.end());

    Path path{{}, {}, last.ray.direction, end_of_path(last.end), 0.0, 0.0, 0.0};
    for (const int i : way) {
        if (segments[i].event) path.events.push_back(*segments[i].event);
        if (!segments[i].hit) continue;
        const double length = segments[i].hit->distance;
        path.hits.push_back(*segments[i].hit);
        path.geometric_length += length;
        path.optical_length += segments[i].index * length;
        path.reduced_length += length / segments[i].index;
    }
    if (path.end == PathEnd::absorbed) path.events.push_back(Event::absorbed);
    return path;
}

}  // namespace stepdiag
