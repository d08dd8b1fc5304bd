#include <orrery/models/radio/crosslink_radio.hpp>

#include <algorithm>
#include <stdexcept>

namespace orrery {

CrosslinkRadio::CrosslinkRadio(Options options) : options_(std::move(options)) {
  const std::vector<std::string>& peers = options_.peers;
  for (auto peer = peers.begin(); peer != peers.end(); ++peer) {
    if (peer->empty()) throw std::invalid_argument("CrosslinkRadio: the name of a peer is empty");
    if (std::find(peers.begin(), peer, *peer) != peer) {
      throw std::invalid_argument("CrosslinkRadio: peer \"" + *peer + "\" is given twice");
    }
  }
}

void CrosslinkRadio::from_flight(DeviceContext& io, Bytes bytes) {
  for (const std::string& peer : options_.peers) io.transmit(peer, bytes);
}

void CrosslinkRadio::from_air(DeviceContext& io, std::string_view sender, Bytes frame) {
  (void)sender;  // the frame says who sent it, if the protocol wants it known
  io.to_flight(frame);
}

}  // namespace orrery
