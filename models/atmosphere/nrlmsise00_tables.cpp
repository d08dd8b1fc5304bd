#include <orrery/models/atmosphere/nrlmsise00_tables.hpp>
#include <orrery/models/data/embedded_tables.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace orrery::nrlmsise00 {
namespace {

using Row = std::span<const double>;

struct BlockSize {
  std::string_view name;
  std::size_t rows, columns;
};

// The published arrays in the order of the file. "sam" is published and not used by the model.
constexpr BlockSize kBlocks[] = {
    {"pt", 1, 150}, {"pd", 9, 150},  {"ps", 1, 150},   {"pdl", 2, 25},  {"ptm", 1, 10},
    {"pdm", 8, 10}, {"ptl", 4, 100}, {"pma", 10, 100}, {"sam", 1, 100}, {"pavgm", 1, 10}};

/// Reads the blocks `@ name rows columns` and their numbers; knows where it is, for the messages.
class BlockReader {
 public:
  BlockReader(std::string_view text, std::string_view source) : text_(text), source_(source) {
    for (const BlockSize& block : kBlocks) read(block);
    if (!next_word().empty()) fail("text after the last block");
  }

  Row row(std::string_view name, std::size_t index = 0) const {
    for (const BlockSize& block : kBlocks) {
      if (block.name != name) continue;
      return Row(values_.find(name)->second).subspan(index * block.columns, block.columns);
    }
    throw std::logic_error("BlockReader::row: no block " + std::string(name));
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument("NRLMSISE-00 coefficients: " + source_ + ", line " +
                                std::to_string(line_) + ": " + what);
  }

  std::string_view next_word() {
    while (!text_.empty() && (text_[0] == ' ' || text_[0] == '\n' || text_[0] == '\r')) {
      if (text_[0] == '\n') ++line_;
      text_.remove_prefix(1);
    }
    const std::string_view word = text_.substr(0, text_.find_first_of(" \r\n"));
    text_.remove_prefix(word.size());
    return word;
  }

  void read(const BlockSize& block) {
    const std::string head = "@ " + std::string(block.name) + " " + std::to_string(block.rows) +
                             " " + std::to_string(block.columns);
    for (const std::string& expected :
         {std::string("@"), std::string(block.name), std::to_string(block.rows),
          std::to_string(block.columns)}) {
      const std::string_view word = next_word();
      if (word != expected)
        fail("'" + std::string(word) + "' where the block '" + head + "' starts");
    }
    std::vector<double>& values = values_[block.name];
    for (std::size_t i = 0; i < block.rows * block.columns; ++i)
      values.push_back(next_number(block));
  }

  double next_number(const BlockSize& block) {
    const std::string_view word = next_word();
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) {
      fail("'" + std::string(word) + "' in block '" + std::string(block.name) +
           "'; accepted: a finite number, " + std::to_string(block.rows * block.columns) +
           " of them");
    }
    return value;
  }

  std::string_view text_;
  std::string source_;
  std::size_t line_ = 1;
  std::map<std::string_view, std::vector<double>> values_;
};

constexpr int kNone = -1;  // this kind of set has no such term

template <std::size_t N>
using Sets = std::array<Row, N>;  // an empty row is padding

double entry(Row set, int index) {
  return index == kNone || set.empty() ? 0 : set[static_cast<std::size_t>(index)];
}

template <std::size_t N>
Lanes<N> lanes(const Sets<N>& sets, int index) {
  Lanes<N> out{};
  for (std::size_t i = 0; i < N; ++i) out[i] = entry(sets[i], index);
  return out;
}

template <std::size_t Terms, std::size_t N>
TermTable<Terms, N> terms(const Sets<N>& sets, const int (&indices)[Terms]) {
  TermTable<Terms, N> out{};
  for (std::size_t k = 0; k < Terms; ++k) out[k] = lanes(sets, indices[k]);
  return out;
}

template <std::size_t N>
PhaseTable<N> phases(const Sets<N>& sets, double rate, int index) {
  PhaseTable<N> out{};
  for (std::size_t i = 0; i < N; ++i) {
    out.cosine[i] = std::cos(rate * entry(sets[i], index));
    out.sine[i] = std::sin(rate * entry(sets[i], index));
  }
  return out;
}

template <std::size_t N>
Lanes<N> product(const Lanes<N>& a, const Lanes<N>& b) {
  Lanes<N> out{};
  for (std::size_t i = 0; i < N; ++i) out[i] = a[i] * b[i];
  return out;
}

template <std::size_t N>
StormTables<N> storms(const Sets<N>& sets, int rate, int slope, double least_rate) {
  StormTables<N> out{};
  for (std::size_t i = 0; i < N; ++i) {
    if (sets[i].empty()) continue;  // padding uses shape 0
    const StormShape shape{std::max(std::abs(entry(sets[i], rate)), least_rate),
                           entry(sets[i], slope)};
    std::size_t at = 0;
    while (at < out.count &&
           (out.shapes[at].rate != shape.rate || out.shapes[at].slope != shape.slope)) {
      ++at;
    }
    if (at == out.count) out.shapes[out.count++] = shape;
    out.shape_of[i] = at;
  }
  return out;
}

// Indices count from 0, as in the published C code; the paper's count from 1.
using UpperSets = Sets<kUpperLanes>;

MagneticTables<kUpperLanes> daily_tables(const UpperSets& sets) {
  return {.zonal = terms(sets, {32, 45, 34}),
          .zonal_annual = terms(sets, {100, 101, 102}),
          .diurnal = terms(sets, {121, 122, 123}),
          .longitude = terms(sets, {60, 61, 62}),
          .longitude_annual = terms(sets, {115, 116, 117}),
          .ut = terms(sets, {83, 84, 85}),
          .diurnal_phase = phases(sets, kHour_rad, 124),
          .longitude_phase = phases(sets, kDegree_rad, 63),
          .longitude_annual_phase = phases(sets, kDegree_rad, 118),
          .ut_phase = phases(sets, kSecond_rad, 75),
          .longitude_P10 = lanes(sets, 120)};
}

MagneticTables<kUpperLanes> history_tables(const UpperSets& sets) {
  return {.zonal = terms(sets, {50, 96, 54}),
          .zonal_annual = terms(sets, {125, 126, 127}),
          .diurnal = terms(sets, {128, 129, 130}),
          .longitude = terms(sets, {52, 98, 67}),
          .longitude_annual = terms(sets, {133, 134, 135}),
          .ut = terms(sets, {55, 56, 57}),
          .diurnal_phase = phases(sets, kHour_rad, 131),
          .longitude_phase = phases(sets, kDegree_rad, 97),
          .longitude_annual_phase = phases(sets, kDegree_rad, 136),
          .ut_phase = phases(sets, kSecond_rad, 58),
          .longitude_P10 = lanes(sets, 132)};
}

// Splits two equal rows into the parts that multiply cosine and sine of the season.
template <std::size_t Terms>
void split(TermTable<Terms, kUpperLanes>& table, std::size_t k,
           const PhaseTable<kUpperLanes>& phase) {
  table[k] = product(table[k], phase.cosine);
  table[k + 1] = product(table[k + 1], phase.sine);
}

TermTable<19, kUpperLanes> plain_terms(const UpperSets& sets) {
  TermTable<19, kUpperLanes> out =
      terms(sets, {30, 19, 19, 20, 21, 29, 1, 2, 22, 14, 26, 18, 18, 15, 15, 16, 16, 37, 37});
  out[2] = product(out[2], lanes(sets, 59));  // df * dfa
  split(out, 11, phases(sets, kDay_rad, 31));
  split(out, 13, phases(sets, 2 * kDay_rad, 17));
  split(out, 15, phases(sets, 2 * kDay_rad, 17));
  split(out, 17, phases(sets, 2 * kDay_rad, 38));
  return out;
}

UpperTables upper_tables(const BlockReader& file) {
  UpperSets sets{};
  sets[kExosphericTemperature] = file.row("pt");
  sets[kGradient] = file.row("ps");
  for (std::size_t i = 0; i < 9; ++i) sets[kHelium + i] = file.row("pd", i);
  return {.scale = lanes(sets, 0),
          .plain = plain_terms(sets),
          .f1_dfa = lanes(sets, 47),
          .f2_dfa = lanes(sets, 49),
          .flux_df = lanes(sets, 19),
          .flux_df2 = lanes(sets, 20),
          .annual = terms(sets, {9, 10}),
          .tides = terms(sets, {3, 4, 27, 6, 7, 28, 5, 41, 8, 42, 39, 40}),
          .tides_annual = terms(sets, {11, 12, 23, 35, 33, 36, 93, 46, 94, 48}),
          .longitude = terms(sets, {64, 65, 66, 103, 104, 105, 90, 91, 92, 106, 107, 108}),
          .longitude_annual = terms(sets, {109, 110, 111, 112, 113, 114}),
          .ut = terms(sets, {68, 69, 70}),
          .ut_longitude = terms(sets, {76, 77, 78}),
          .longitude_dfa = lanes(sets, 80),
          .ut_P10 = lanes(sets, 95),
          .ut_dfa = lanes(sets, 81),
          .ut_annual_P10 = lanes(sets, 119),
          .ut_longitude_dfa = lanes(sets, 137),
          .annual_phase = phases(sets, kDay_rad, 13),
          .ut_phase = phases(sets, kSecond_rad, 71),
          .ut_longitude_phase = phases(sets, kSecond_rad, 79),
          .daily = daily_tables(sets),
          .history = history_tables(sets),
          .daily_storm = storms(sets, 43, 44, 0),
          .history_storm = storms(sets, 24, 25, 1e-4),
          .history_decay = lanes(sets, 51),
          .history_decay_latitude = lanes(sets, 138)};
}

template <std::size_t N>
LowerTables<N> lower_tables(const Sets<N>& sets, const Lanes<N>& reference) {
  return {.mean = product(lanes(sets, 0), reference),
          .plain = terms(sets, {21, 1, 2, 22, 26, 14, 59}),
          .annual_symmetric = terms(sets, {18, 47, 29}),
          .semiannual = terms(sets, {15, 16, 30}),
          .annual = terms(sets, {9, 10, 20}),
          .semiannual_asymmetric = lanes(sets, 37),
          .annual_symmetric_phase = phases(sets, kDay_rad, 31),
          .semiannual_phase = phases(sets, 2 * kDay_rad, 17),
          .annual_phase = phases(sets, kDay_rad, 13),
          .semiannual_asymmetric_phase = phases(sets, 2 * kDay_rad, 38),
          .tides = terms(sets, {3, 4, kNone, 6, 7, kNone, 5, 41, 8, 42, 39, 40}),
          .tides_annual = terms(sets, {11, 12, 23, 35, 33, 36, kNone, kNone, kNone, kNone}),
          .longitude = terms(sets, {64, 65, 66, 74, 75, 76, 90, 91, 92, 77, 78, 79}),
          .longitude_annual_P10 = lanes(sets, 80),
          .longitude_semiannual_P10 = lanes(sets, 85),
          .longitude_annual = lanes(sets, 83),
          .longitude_semiannual = lanes(sets, 87),
          .longitude_annual_P10_phase = phases(sets, kDay_rad, 81),
          .longitude_semiannual_P10_phase = phases(sets, 2 * kDay_rad, 86),
          .longitude_annual_phase = phases(sets, kDay_rad, 84),
          .longitude_semiannual_phase = phases(sets, 2 * kDay_rad, 88),
          .daily = terms(sets, {32, 45}),
          .history = terms(sets, {50, 96})};
}

/// Where one species' constants stand: its row of pdm, its set, and factors from pdl.
struct SpeciesRow {
  std::size_t row;
  Set set;
  double mass_amu, thermal_diffusion, mixed_up_to_km;
  double mixing_ratio_factor, mixing_height_factor, mixing_scale_factor;
  double chemistry_factor, chemistry_height_factor, chemistry_scale_factor;
};

Species species(const BlockReader& file, const SpeciesRow& at) {
  const Row pdm = file.row("pdm", at.row);
  const double scale = file.row("pd", at.set - kHelium)[0];
  return {
      .set = at.set,
      .mass_amu = at.mass_amu,
      .thermal_diffusion = at.thermal_diffusion,
      .mixed_up_to_km = at.mixed_up_to_km,
      .ln_boundary_density = std::log(pdm[0] * scale),
      .turbopause_km = pdm[2],
      .ln_mixing_ratio = at.mixing_ratio_factor > 0 ? std::log(pdm[1] * at.mixing_ratio_factor) : 0,
      .mixing_height_km = pdm[4] * at.mixing_height_factor,
      .mixing_scale_km = pdm[5] * at.mixing_scale_factor,
      .chemistry = pdm[3] * at.chemistry_factor,
      .chemistry_height_km = pdm[6] * at.chemistry_height_factor,
      .chemistry_scale_km = pdm[7] * at.chemistry_scale_factor};
}

void fill_species(const BlockReader& file, Tables& out) {
  const Row a = file.row("pdl", 0), b = file.row("pdl", 1);
  // Helium is mixed below 200 km, the others up to and at their limit: the double before 200.
  constexpr double kBelow200 = 199.99999999999997;
  out.helium = species(file, {0, kHelium, 4, -0.38, kBelow200, 1, b[0], b[1], 0, 0, 0});
  out.oxygen = species(file, {1, kOxygen, 16, 0, 300, 0, b[2], b[3], b[14], b[12], b[13]});
  out.nitrogen_molecules = species(file, {2, kNitrogenMolecules, 28, 0, 160, 0, 0, 0, 0, 0, 0});
  out.oxygen_molecules = species(file, {3, kOxygenMolecules, 32, 0, 250, 1, b[6], b[7], 0, 0, 0});
  out.argon = species(file, {4, kArgon, 40, 0.17, 240, 1, b[8], b[9], 0, 0, 0});
  out.hydrogen = species(
      file, {5, kHydrogen, 1, -0.38, 320, std::abs(b[17]), b[10], b[11], b[20], b[18], b[19]});
  out.nitrogen =
      species(file, {6, kNitrogen, 14, 0, 450, std::abs(a[2]), a[0], a[1], a[5], a[3], a[4]});

  const Row oxygen = file.row("pdm", 1), molecules = file.row("pdm", 3);
  out.oxygen_ratio = oxygen[1] * b[16];
  out.oxygen_scale2_km = oxygen[5] * b[4];
  out.oxygen_molecules_departure = molecules[3] * b[23];
  out.oxygen_molecules_departure_height_km = molecules[6] * b[21];
  out.oxygen_molecules_departure_scale_km = molecules[7] * b[22];
  out.oxygen_molecules_departure_scale2_km = molecules[7] * a[22];
  out.departure_dfa = a[23];
}

void fill_scalars(const BlockReader& file, Tables& out) {
  const Row a = file.row("pdl", 0), b = file.row("pdl", 1), ptm = file.row("ptm");
  out.exospheric_temperature_K = ptm[0];
  out.lower_boundary_temperature_K = ptm[1];
  out.gradient_Kpkm = ptm[3];
  out.lower_boundary_km = ptm[5];
  out.bates_from_km = b[15];
  out.turbopause_factor = b[24];
  out.turbopause_annual = a[24];

  const Row nitrogen = file.row("pdm", 2), hot = file.row("pdm", 7);
  out.merging_scale_km = nitrogen[3] * b[5];
  out.mean_mass_amu = nitrogen[4];
  out.anomalous_temperature_K = hot[9] * a[6];
  out.anomalous_height_km = hot[4];
  out.anomalous_scale_km = hot[5];
  out.ln_anomalous_density = std::log(hot[0] * file.row("pd", 8)[0]);
  out.helium_fraction = file.row("pdm", 0)[1];
  out.oxygen_molecules_fraction = file.row("pdm", 3)[1];
  out.argon_fraction = file.row("pdm", 4)[1];
}

void fill_lower(const BlockReader& file, Tables& out) {
  const Row ptm = file.row("ptm"), pavgm = file.row("pavgm");
  const auto ptl = [&](std::size_t i) { return file.row("ptl", i); };
  const auto pma = [&](std::size_t i) { return file.row("pma", i); };
  out.lower_thermosphere = lower_tables<6>({ptl(0), ptl(1), ptl(2), ptl(3), pma(8), {}},
                                           {ptm[6], ptm[2], ptm[7], ptm[4], ptm[8], 0});
  out.mesosphere =
      lower_tables<4>({pma(0), pma(1), pma(2), pma(9)}, {pavgm[0], pavgm[1], pavgm[2], pavgm[8]});
  out.stratosphere = lower_tables<6>({pma(3), pma(4), pma(5), pma(6), pma(7), {}},
                                     {pavgm[3], pavgm[4], pavgm[5], pavgm[6], pavgm[7], 0});
}

}  // namespace

Tables parse_tables(std::string_view text, std::string_view source_name) {
  const BlockReader file(text, source_name);
  Tables out{};
  out.upper = upper_tables(file);
  fill_lower(file, out);
  fill_species(file, out);
  fill_scalars(file, out);
  return out;
}

const Tables& tables() {
  static const Tables kTables = parse_tables(embedded::nrlmsise00_coefficients(),
                                             "nrlmsise00_coefficients.txt (compiled in)");
  return kTables;
}

}  // namespace orrery::nrlmsise00
