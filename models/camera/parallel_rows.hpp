/// Rows of an image on several threads. Not installed.
#pragma once

#include <orrery/harness/kernel/worker_thread.hpp>

#include <thread>
#include <vector>

namespace orrery {

/// Calls work(first_row, end_row) for bands that together are 0 ... height - 1. `work` writes its
/// own rows only and reads nothing that another band writes, so that the bands' number and the
/// order in which they end do not show; it does not throw.
template <class Work>
void for_bands_of_rows(int threads, int height, const Work& work) {
  if (threads <= 1) return work(0, height);
  std::vector<std::thread> others;
  for (int k = 1; k < threads; ++k) {
    others.push_back(worker_thread(
        [&work, k, threads, height] { work(height * k / threads, height * (k + 1) / threads); }));
  }
  work(0, height / threads);
  for (std::thread& other : others) other.join();
}

}  // namespace orrery
