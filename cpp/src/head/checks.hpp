// Range checks. Each throws InvalidArgument; the message names the owner and the value, and states the expected range
// and the value given.
#pragma once

#include <cmath>
#include <sstream>
#include <string>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

struct Check {
    const char* owner;  // "camera"

    void finite(const char* key, double value, const char* what) const {
        require(std::isfinite(value), key, value, what, "");
    }
    void positive(const char* key, double value, const char* what) const {
        require(std::isfinite(value) && value > 0.0, key, value, what, " above 0");
    }
    void not_negative(const char* key, double value, const char* what) const {
        require(std::isfinite(value) && value >= 0.0, key, value, what, ", 0 or more");
    }
    void within(const char* key, double value, double lowest, double highest, const char* what) const {
        std::ostringstream range;
        range << " of " << lowest << " to " << highest;
        require(value >= lowest && value <= highest, key, value, what, range.str());
    }

private:
    void require(bool good, const char* key, double value, const char* what, const std::string& range) const {
        if (good) return;
        std::ostringstream message;
        message << owner << ' ' << key << ": expected " << what << range << ", got " << value;
        throw InvalidArgument(message.str());
    }
};

}  // namespace stepdiag
