// SPDX-License-Identifier: Apache-2.0
// The main function of every test program: reseeds the one random generator before each test, so
// that a test gives the same numbers alone and among others.
#include <gtest/gtest.h>

#include "support/random.hpp"

namespace {

class Reseed : public testing::EmptyTestEventListener {
  void OnTestStart(const testing::TestInfo&) override { striper::testing::reseed(); }
};

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  testing::UnitTest::GetInstance()->listeners().Append(new Reseed);
  return RUN_ALL_TESTS();
}
