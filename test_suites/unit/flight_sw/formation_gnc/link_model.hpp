/// A crosslink for tests of the protocol: loses in bursts, delays log-normally, doubles, and so
/// reorders. The model of radio_link.md, written anew: the simulator's own is not used here.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

namespace formation_gnc_test {

using Packet = std::vector<unsigned char>;

/// SplitMix64.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits() {
    state_ += 0x9E3779B97F4A7C15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double normal() {
    for (;;) {
      const double x = 2.0 * uniform() - 1.0;
      const double y = 2.0 * uniform() - 1.0;
      const double r2 = x * x + y * y;
      if (r2 > 0.0 && r2 < 1.0) return x * std::sqrt(-2.0 * std::log(r2) / r2);
    }
  }

 private:
  std::uint64_t state_;
};

struct LinkQuality {
  double p_on = 0.05, p_off = 0.25;  // of the Gilbert channel, per packet: 16.7 % loss
  double sigma = 0.767528;           // of the logarithm of the delay, whose median is 1 s
  double duplicates = 0.02;
};

class LinkModel {
 public:
  LinkModel(std::uint64_t seed, const LinkQuality& quality) : draws_(seed), quality_(quality) {}

  void send(std::int64_t now_ns, const Packet& packet) {
    ++sent;
    const double u = draws_.uniform();
    off_ = off_ ? u >= quality_.p_off : u < quality_.p_on;
    if (off_ || now_ns < blacked_out_until_ns) {
      ++lost;
      return;
    }
    put(now_ns, packet);
    if (draws_.uniform() < quality_.duplicates) put(now_ns, packet);
  }
  std::vector<Packet> arrivals(std::int64_t now_ns) {
    std::vector<Packet> out;
    while (!flying_.empty() && flying_.begin()->first <= now_ns) {
      if (flying_.begin()->second.number < newest_) ++reordered;
      newest_ = std::max(newest_, flying_.begin()->second.number);
      out.push_back(flying_.begin()->second.packet);
      flying_.erase(flying_.begin());
    }
    return out;
  }

  std::int64_t blacked_out_until_ns = 0;
  int sent = 0, lost = 0, reordered = 0;

 private:
  struct Flying {
    int number;
    Packet packet;
  };
  void put(std::int64_t now_ns, const Packet& packet) {
    const double delay_s = std::exp(quality_.sigma * draws_.normal());
    flying_.insert({now_ns + static_cast<std::int64_t>(1e9 * delay_s), {sent, packet}});
  }
  Draws draws_;
  LinkQuality quality_;
  bool off_ = false;
  int newest_ = 0;
  std::multimap<std::int64_t, Flying> flying_;
};

}  // namespace formation_gnc_test
