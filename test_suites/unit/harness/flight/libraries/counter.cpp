// A private dependency: state that no header shows. Adds 1 to what INNER adds, if it is given.
#include <string>

extern "C" int COUNTER();
#ifdef INNER
extern "C" int INNER();
#endif

static std::string counted = "";  // its constructor has to run, in the heap of the process

extern "C" int COUNTER() {
  counted += '.';
#ifdef INNER
  return static_cast<int>(counted.size()) + 100 * INNER();
#else
  return static_cast<int>(counted.size());
#endif
}
