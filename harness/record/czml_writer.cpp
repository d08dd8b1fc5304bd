#include <orrery/harness/record/czml_writer.hpp>
#include <orrery/harness/record/json_text.hpp>
#include <orrery/harness/record/number_format.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

constexpr std::size_t kSamplesOfAPacket = 512;

// Position, in red, green, blue: as many as a formation usually has, then again.
constexpr const char* kColours[] = {"[97,175,239,255]",  "[229,160,90,255]", "[123,199,126,255]",
                                    "[197,138,224,255]", "[224,192,96,255]", "[255,123,114,255]"};

std::string in_quotes(const std::string& text) {
  std::string out;
  append_json_text(out, text);
  return out;
}

}  // namespace

CzmlWriter::CzmlWriter(const std::filesystem::path& path, const std::string& name, SimTime epoch,
                       Duration gps_minus_utc)
    : file_(path), epoch_(epoch), gps_minus_utc_(gps_minus_utc) {
  const std::string begin = utc(epoch);
  file_.write("[\n{\"id\":\"document\",\"name\":" + in_quotes(name) +
              ",\"version\":\"1.0\",\"clock\":{\"currentTime\":\"" + begin +
              "\",\"multiplier\":60,\"range\":\"LOOP_STOP\",\"interval\":\"" + begin + "/");
  end_position_ = file_.size();
  file_.write(begin + "\"}}");
}

std::string CzmlWriter::utc(SimTime t) const {
  return to_calendar(t - gps_minus_utc_) + "Z";
}

CzmlWriter::Object& CzmlWriter::object_of(const std::string& name) {
  const auto found = std::find_if(objects_.begin(), objects_.end(),
                                  [&name](const Object& one) { return one.name == name; });
  if (found != objects_.end()) return *found;
  objects_.emplace_back();
  objects_.back().name = name;
  return objects_.back();
}

void CzmlWriter::state(const std::string& name, SimTime t, const Components& r_ECI,
                       const Components& v_ECI) {
  const auto finite = [](const Components& v) {
    return std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); });
  };
  if (!finite(r_ECI) || !finite(v_ECI)) {
    throw std::invalid_argument("CzmlWriter: a state of " + name + " at " + to_string(t) +
                                " is not finite");
  }
  Object& object = object_of(name);
  if (object.count > 0) object.samples += ",\n";
  append_number(object.samples, static_cast<double>(to_ns(t - epoch_)) / 1e9);
  for (const double x : r_ECI) append_fixed(object.samples += ',', x, 3);
  for (const double x : v_ECI) append_fixed(object.samples += ',', x, 6);
  if (++object.count == kSamplesOfAPacket) write_samples(object);
}

void CzmlWriter::write_samples(Object& object) {
  if (object.count == 0) return;
  std::string packet = ",\n{\"id\":" + in_quotes(object.name);
  if (!object.begun) {
    const auto index = static_cast<std::size_t>(&object - objects_.data());
    const std::string colour =
        std::string("{\"rgba\":") + kColours[index % std::size(kColours)] + "}";
    packet += ",\"name\":" + in_quotes(object.name) +
              ",\"label\":{\"text\":" + in_quotes(object.name) +
              ",\"font\":\"12px sans-serif\",\"fillColor\":" + colour +
              ",\"horizontalOrigin\":\"LEFT\",\"pixelOffset\":{\"cartesian2\":[10,0]}}" +
              ",\"point\":{\"pixelSize\":6,\"color\":" + colour +
              "},\"path\":{\"leadTime\":0,\"trailTime\":5700,\"resolution\":60,\"width\":1.5," +
              "\"material\":{\"solidColor\":{\"color\":" + colour + "}}}";
    object.begun = true;
  }
  packet += ",\"position\":{\"epoch\":\"" + utc(epoch_) +
            "\",\"referenceFrame\":\"INERTIAL\",\"interpolationAlgorithm\":\"HERMITE\"," +
            "\"interpolationDegree\":5,\"cartesianVelocity\":[\n" + object.samples + "]}}";
  file_.write(packet);
  object.samples.clear();
  object.count = 0;
}

void CzmlWriter::close(SimTime end) {
  for (Object& object : objects_) write_samples(object);
  for (const Object& object : objects_) {
    file_.write(",\n{\"id\":" + in_quotes(object.name) + ",\"availability\":\"" + utc(epoch_) +
                "/" + utc(end) + "\"}");
  }
  file_.write("\n]\n");
  file_.overwrite(end_position_, utc(end));
  file_.close();
}

}  // namespace orrery
