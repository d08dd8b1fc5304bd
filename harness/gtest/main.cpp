#include <gmock/gmock.h>

#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/listener.hpp>

int main(int argc, char** argv) {
  orrery::Init(&argc, argv);
  testing::InitGoogleMock(&argc, argv);
  return orrery::run_all_tests();
}
