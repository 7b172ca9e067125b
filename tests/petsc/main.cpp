// The same matrices and solutions whatever the number of processes. To be run by mpirun -n R, for several R;
// every process computes what one machine would, and compares.

#include <gtest/gtest.h>
#include <petscsys.h>

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  PetscInitialize(&argc, &argv, nullptr, nullptr);
  PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr);
  const int result = RUN_ALL_TESTS();
  PetscFinalize();
  return result;
}
