// What C++ keeps once per program unless told otherwise: an inline variable, a static of an inline
// function, a static member of a template. Built with default visibility on purpose.

#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "orrery_flight.hpp"

namespace statics {

inline int inline_variable = 0;
inline int& static_of_inline_function() {
  static int value = 0;
  return value;
}
template <class T>
struct Template {
  static int member;
};
template <class T>
int Template<T>::member = 0;

// Constructed when the library is loaded, in the heap of the process.
std::map<int, std::string> table = {{1, "one, and long enough to be on the heap of its process"}};

// Destroyed last: reads the heap, which a crash takes away.
struct Farewell {
  std::vector<int> values = std::vector<int>(10, 1);
  ~Farewell() {
    for (int& v : values) v = 2;
  }
};
Farewell farewell;
thread_local Farewell farewell_of_thread;

struct OfItsOwn : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace statics

class Statics {
 public:
  Statics(orrery_abi::Host host, const orrery_boot&) : host_(host) {
    statics::farewell_of_thread.values[0] = 3;
  }

  __attribute__((no_sanitize("undefined"))) std::int32_t order(std::int64_t,
                                                               orrery_abi::Bytes bytes) {
    const char what = bytes.size == 0 ? ' ' : *static_cast<const char*>(bytes.data);
    if (what == 'x') throw statics::OfItsOwn("nobody catches this");
    if (what == 'c') {
      try {
        throw 1;
      } catch (int) {
        *static_cast<volatile int*>(nullptr) = 1;
      }
    }
    const unsigned char counts[4] = {
        static_cast<unsigned char>(++statics::inline_variable),
        static_cast<unsigned char>(++statics::static_of_inline_function()),
        static_cast<unsigned char>(++statics::Template<int>::member),
        static_cast<unsigned char>(statics::table.size())};
    statics::table[static_cast<int>(statics::table.size()) + 1] = "another";
    host_.output(1, {counts, sizeof counts});
    return ORRERY_OK;
  }
  std::int32_t tick(std::int64_t) { return ORRERY_OK; }

  using P = orrery_abi::Port<Statics>;
  static const P (&ports())[2] {
    static const P table[2] = {{1, ORRERY_IN, ORRERY_PACKET, "do", 16, &Statics::order},
                               {1, ORRERY_OUT, ORRERY_PACKET, "say", 16, nullptr}};
    return table;
  }

 private:
  orrery_abi::Host host_;
};
ORRERY_FLIGHT_LIBRARY(Statics, "statics", "1.0")
