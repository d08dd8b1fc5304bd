#include "formation_gnc/mission/event.hpp"

#include <cmath>

namespace formation_gnc {

void put(ByteWriter* to, const Event& event) {
  to->u32(event.id);
  to->u8(static_cast<unsigned>(event.kind));
  to->u8(static_cast<unsigned>(event.mode));
  to->u8(event.observations);
  to->u8(event.every);
  to->i64(event.begin_ns);
  to->i64(event.end_ns);
  to->f64(event.a_m);
  to->f64(event.b_m);
}

bool get(ByteReader* from, Event* event) {
  Event read;
  read.id = from->u32();
  const unsigned kind = from->u8(), mode = from->u8();
  read.observations = static_cast<std::uint8_t>(from->u8());
  read.every = static_cast<std::uint8_t>(from->u8());
  read.begin_ns = from->i64();
  read.end_ns = from->i64();
  read.a_m = from->f64();
  read.b_m = from->f64();
  if (kind != 1 && kind != 2) return false;
  if (mode > FORMATION_GNC_ESCAPE) return false;
  if (read.begin_ns < 0 || read.end_ns < 0) return false;
  if (!std::isfinite(read.a_m) || !std::isfinite(read.b_m)) return false;
  read.kind = static_cast<Event::Kind>(kind);
  read.mode = static_cast<Mode>(mode);
  *event = read;
  return true;
}

}  // namespace formation_gnc
