// Files that are no calibration for a controller: refused by the C++ and by the C interface, for the reason that
// tests/data/bad_tables/refusals.txt states. (tests/python/controller/test_bad_tables.py reads the same files.)
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "stepdiag/controller/compensator.h"
#include "stepdiag/controller/compensator.hpp"
#include "support/refuses.hpp"

namespace {

const std::string folder = STEPDIAG_TEST_DATA "/bad_tables/";
const char* const chain = "[w X' b Y Z t]";

std::map<std::string, std::string> refusals() {
    std::map<std::string, std::string> words;
    std::ifstream stream(folder + "refusals.txt");
    for (std::string line; std::getline(stream, line);) {
        const auto colon = line.find(": ");
        words[line.substr(0, colon)] = line.substr(colon + 2);
    }
    return words;
}

}  // namespace

TEST(BadTables, AreRefusedWithTheFileAndTheReason) {
    const auto words = refusals();
    EXPECT_GE(words.size(), 40u);
    for (const auto& [file, reason] : words) {
        SCOPED_TRACE(file);
        expect_refused([&, &name = file] { stepdiag::Compensator::load(folder + name, chain); }, reason);
        expect_refused([&, &name = file] { stepdiag::Compensator::load(folder + name, chain); }, file);
    }
}

TEST(BadTables, AreRefusedInCWithTheSameWords) {
    for (const auto& [file, reason] : refusals()) {
        SCOPED_TRACE(file);
        char message[1000] = "";
        EXPECT_EQ(stepdiag_compensator_load((folder + file).c_str(), chain, nullptr, message, sizeof message), nullptr);
        EXPECT_NE(std::string(message).find(reason), std::string::npos) << message;
        EXPECT_NE(std::string(message).find(file), std::string::npos) << message;
    }
}

TEST(BadTables, ReasonIsCutToItsBuffer) {
    for (const std::size_t size : {std::size_t(1), std::size_t(2), std::size_t(30)}) {
        std::string message(size + 1, '#');
        EXPECT_EQ(stepdiag_compensator_load((folder + "empty.csv").c_str(), chain, nullptr, message.data(), size),
                  nullptr);
        EXPECT_EQ(message.find('\0'), size - 1);
        EXPECT_EQ(message[size], '#');
    }
    EXPECT_EQ(stepdiag_compensator_load((folder + "empty.csv").c_str(), chain, nullptr, nullptr, 0), nullptr);
}

TEST(BadTables, AbsentArgumentsAreRefusedInC) {
    char message[200] = "";
    EXPECT_EQ(stepdiag_compensator_load(nullptr, chain, nullptr, message, sizeof message), nullptr);
    EXPECT_NE(std::string(message).find("path"), std::string::npos) << message;
    EXPECT_EQ(stepdiag_compensator_load("/dev/null", nullptr, nullptr, message, sizeof message), nullptr);
    EXPECT_NE(std::string(message).find("chain"), std::string::npos) << message;
    EXPECT_NO_THROW(stepdiag_compensator_free(nullptr));
}

TEST(BadTables, TooManyRowsAreRefused) {
    const std::string path = ::testing::TempDir() + "stepdiag_too_many_rows.csv";
    {
        std::ofstream file(path);
        file << "# chain=" << chain << "\n# volume_mm=100000 10 10\n# tool_mm=0 0 0\n"
             << "parameter,position_mm,value,unit,standard_uncertainty\n";
        for (int k = 0; k <= 1'000'000; ++k) file << "EXX," << k / 10.0 << "," << k % 2 << ",um,\n";
    }
    expect_refused([&] { stepdiag::Compensator::load(path, chain); }, "nodes");
    std::remove(path.c_str());
}
