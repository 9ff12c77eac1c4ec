// Expectation that bad input throws an InvalidArgument whose message names the culprit.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "stepdiag/core/error.hpp"

template <class Call>
void expect_refused(Call&& call, const std::string& culprit) {
    try {
        call();
        ADD_FAILURE() << "accepted, but should be refused for: " << culprit;
    } catch (const stepdiag::InvalidArgument& error) {
        EXPECT_NE(std::string(error.what()).find(culprit), std::string::npos)
            << "the message \"" << error.what() << "\" does not name \"" << culprit << "\"";
    }
}
