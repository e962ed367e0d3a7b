// main() of the tests that concern MPI: every rank runs every test; a failure on any rank fails the program.
#include <gtest/gtest.h>

#include "parallel/comm.h"

int main(int argc, char** argv) {
  const bedflow::MpiSession session(&argc, &argv);
  testing::InitGoogleTest(&argc, argv);
  const bedflow::Comm world = bedflow::Comm::world();
  if (!world.root()) {  // the other ranks report failures only
    delete testing::UnitTest::GetInstance()->listeners().Release(
        testing::UnitTest::GetInstance()->listeners().default_result_printer());
  }
  const int failed = RUN_ALL_TESTS();
  const bool any = world.any(failed != 0);
  if (any && failed == 0 && world.root()) std::cerr << "a test failed on another rank; run it there to see which\n";
  return any ? 1 : 0;
}
