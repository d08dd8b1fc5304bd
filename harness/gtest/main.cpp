#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/listener.hpp>

#include <gmock/gmock.h>

int main(int argc, char** argv) {
  orrery::Init(&argc, argv);
  testing::InitGoogleMock(&argc, argv);
  return orrery::run_all_tests();
}
