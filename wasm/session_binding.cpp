#include "wasm/session_binding.h"

#include <emscripten/bind.h>

#include "core/wire/point_volume_message.h"
#include "wasm/binding_help.h"

namespace spinaltap::wasm {
namespace {

using emscripten::val;

/// A property of a parsed JSON object; `fallback` when it is absent.
Result<double> numberIn(const val& object, const char* key, double fallback) {
  const val found = object[key];
  if (found.isUndefined()) return fallback;
  if (!found.isNumber()) return fail(ErrorCode::InvalidArgument, std::string("config: ") + key + " is not a number");
  return found.as<double>();
}
Result<std::string> textIn(const val& object, const char* key, const char* fallback) {
  const val found = object[key];
  if (found.isUndefined() || found.isNull()) return std::string(fallback);
  if (!found.isString()) return fail(ErrorCode::InvalidArgument, std::string("config: ") + key + " is not a text");
  return found.as<std::string>();
}
bool isObject(const val& value) { return !value.isNull() && value.typeOf().as<std::string>() == "object"; }

Result<plan::Bit> bitIn(const val& config) {
  plan::Bit bit;
  const val object = config["bit"];
  if (object.isUndefined()) return bit;
  if (!isObject(object)) return fail(ErrorCode::InvalidArgument, "config: bit is not an object");
  for (const auto& [key, field] : {std::pair{"diameter_mm", &bit.diameter_mm},
                                   {"cone_length_mm", &bit.cone_length_mm},
                                   {"length_mm", &bit.length_mm}}) {
    const Result<double> number = numberIn(object, key, *field);
    if (!number) return tl::unexpected(number.error());
    *field = *number;
  }
  return bit;
}

Result<SessionBinding::Settings> settingsOf(const val& config, const point_volume::Lattice& lattice) {
  if (!isObject(config)) return fail(ErrorCode::InvalidArgument, "config: not a JSON object");
  SessionBinding::Settings settings;
  recording::Header& header = settings.header;
  header.core_version = SPINALTAP_VERSION;
  for (const auto& [key, field] : {std::pair{"engine", &header.config.engine},
                                   {"case_id", &header.case_id},
                                   {"path_id", &header.path_id},
                                   {"scene", &header.scene}}) {
    Result<std::string> text = textIn(config, key, field->c_str());
    if (!text) return tl::unexpected(text.error());
    *field = std::move(*text);
  }
  const Result<plan::Bit> bit = bitIn(config);
  if (!bit) return tl::unexpected(bit.error());
  header.config.bit = *bit;
  const Result<double> speed = numberIn(config, "speed_rpm", header.config.speed_rpm);
  if (!speed) return tl::unexpected(speed.error());
  header.config.speed_rpm = *speed;
  const Result<double> stiffness = numberIn(config, "stiffness_N_mm", 0.0);
  if (!stiffness) return tl::unexpected(stiffness.error());
  if (*stiffness != 0.0) header.config.coupling = haptics::Coupling{*stiffness, 0};
  const Result<double> length = numberIn(config, "length_mm", lattice.discZ_mm(lattice.discs - 1));
  if (!length) return tl::unexpected(length.error());
  settings.length_mm = *length;
  return settings;
}

Result<std::unique_ptr<SessionBinding>> fromBytes(const val& bytes_array, const val& config) {
  const Result<std::vector<std::byte>> bytes = bytesOf(bytes_array, "point volume");
  if (!bytes) return tl::unexpected(bytes.error());
  Result<point_volume::PointVolume> volume = wire::decodePointVolume(*bytes);
  if (!volume) return tl::unexpected(volume.error());
  const Result<SessionBinding::Settings> settings = settingsOf(config, volume->lattice);
  if (!settings) return tl::unexpected(settings.error());
  return SessionBinding::create(std::move(*volume), *settings);
}

SessionBinding* make(const val& bytes, const val& config) { return orNull(fromBytes(bytes, config)); }

double meanDensity(const point_volume::PointVolume& volume, const std::vector<std::uint32_t>& points) {
  if (points.empty()) return 0;
  double sum = 0;
  for (const std::uint32_t point : points) sum += volume.density_mg_cm3[point];
  return sum / static_cast<double>(points.size());
}

metrics::Plan planOf(const SessionBinding::Settings& settings, const point_volume::Lattice& lattice) {
  return {settings.header.config.bit, settings.length_mm, lattice, {}};
}

}  // namespace

Result<std::unique_ptr<SessionBinding>> SessionBinding::create(point_volume::PointVolume volume,
                                                               const Settings& settings) {
  Result<session::Session> session = session::Session::create(std::move(volume), settings.header.config);
  if (!session) return tl::unexpected(session.error());
  return std::unique_ptr<SessionBinding>(new SessionBinding(std::move(*session), settings));
}

SessionBinding::SessionBinding(session::Session session, const Settings& settings)
    : session_(std::move(session)),
      header_(settings.header),
      alive_before_(session_.volume().alive),
      tracker_(session_.volume()),
      metrics_(planOf(settings, session_.volume().lattice)) {}

StepResult SessionBinding::step(double t_us, double tx, double ty, double tz, double ax, double ay, double az,
                                bool spinning) {
  const session::Input input{wholeOf(t_us), {tx, ty, tz}, {ax, ay, az}, spinning};
  removed_.clear();
  const session::Output output = session_.step(
      input, [&](std::span<const std::uint32_t> some) { removed_.insert(removed_.end(), some.begin(), some.end()); });
  inputs_.push_back(input);
  states_.push_back({output.cycle, output.state_hash, output.removed_total});
  removed_all_.insert(removed_all_.end(), removed_.begin(), removed_.end());
  if (output.status == session::Status::Ok) {
    const plan::Bit& bit = header_.config.bit;
    if (output.removed > 0) {
      tracker_.update(session_.volume(), removed_,
                      {output.bit.tip_mm, output.bit.axis, bit.diameter_mm / 2, bit.cone_length_mm});
    }
    metrics_.add({input.t_us, output.bit.tip_mm, output.bit.axis, spinning, output.thrust_N, removed_});
  }
  return {static_cast<int>(output.status),
          static_cast<double>(output.cycle),
          static_cast<double>(output.removed),
          static_cast<double>(output.removed_total),
          output.thrust_N,
          output.depth_mm,
          output.behind,
          output.bit.tip_mm,
          output.bit.axis,
          output.force_N,
          output.torque_Nmm,
          haptics::fromTool(output.bit.axis, output.force_N),
          meanDensity(session_.volume(), removed_)};
}

std::string SessionBinding::stateHash() const { return hexOf(session_.stateHash()); }
double SessionBinding::points() const { return static_cast<double>(session_.volume().lattice.points()); }
double SessionBinding::pointsAlive() const { return static_cast<double>(countAlive(session_.volume())); }

val SessionBinding::aliveBits() const { return aliveBitsOf(session_.volume()); }

val SessionBinding::takeSplats() {
  const std::vector<splats::Splat> taken = tracker_.takeExposed(session_.volume());
  taken_indices_.clear();
  for (const splats::Splat& splat : taken) taken_indices_.push_back(splat.index);
  return floatsOf(taken);
}
val SessionBinding::takeSplatIndices() const { return arrayOf("Uint32Array", taken_indices_); }
val SessionBinding::takeHidden() { return arrayOf("Uint32Array", tracker_.takeHidden()); }

val SessionBinding::recordingBytes() const {
  point_volume::PointVolume before = session_.volume();
  before.alive = alive_before_;
  std::vector<std::byte> bytes;
  const auto keep = [&](std::span<const std::byte> part) {
    bytes.insert(bytes.end(), part.begin(), part.end());
    return true;
  };
  Result<recording::Writer> writer = recording::Writer::begin(header_, before, keep);
  if (!writer) return val::undefined();  // over 2^26 points: no browser holds that many
  std::span<const std::uint32_t> left = removed_all_;
  std::uint64_t removed_total = 0;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    session::Output output;
    output.cycle = states_[i].cycle, output.state_hash = states_[i].state_hash;
    const auto count = static_cast<std::size_t>(states_[i].removed_total - removed_total);
    for (const std::uint32_t point : left.first(count)) before.alive[point >> 6] &= ~(1ull << (point & 63));
    (void)writer->append(inputs_[i], output, left.first(count), before);  // the sink cannot fail
    left = left.subspan(count);
    removed_total = states_[i].removed_total;
  }
  (void)writer->finish();
  return bytesToArray(bytes);
}

std::string SessionBinding::metricsJson() const { return metrics::toJson(metrics::named(metrics_.finish())); }

void bindSession() {
  emscripten::value_array<Vec3>("Vec3").element(&Vec3::x).element(&Vec3::y).element(&Vec3::z);
  emscripten::value_object<StepResult>("StepResult")
      .field("status", &StepResult::status)
      .field("cycle", &StepResult::cycle)
      .field("removed", &StepResult::removed)
      .field("removed_total", &StepResult::removed_total)
      .field("thrust_N", &StepResult::thrust_N)
      .field("depth_mm", &StepResult::depth_mm)
      .field("behind", &StepResult::behind)
      .field("tip", &StepResult::tip)
      .field("axis", &StepResult::axis)
      .field("force_N", &StepResult::force_N)
      .field("torque_Nmm", &StepResult::torque_Nmm)
      .field("hand_force_N", &StepResult::hand_force_N)
      .field("density_mg_cm3", &StepResult::density_mg_cm3);
  emscripten::function("makeSession", &make, emscripten::allow_raw_pointers());
  emscripten::class_<SessionBinding>("LiveSession")
      .function("step", &SessionBinding::step)
      .function("stateHash", &SessionBinding::stateHash)
      .function("points", &SessionBinding::points)
      .function("pointsAlive", &SessionBinding::pointsAlive)
      .function("aliveBits", &SessionBinding::aliveBits)
      .function("takeSplats", &SessionBinding::takeSplats)
      .function("takeSplatIndices", &SessionBinding::takeSplatIndices)
      .function("takeHidden", &SessionBinding::takeHidden)
      .function("recordingBytes", &SessionBinding::recordingBytes)
      .function("metricsJson", &SessionBinding::metricsJson);
}

}  // namespace spinaltap::wasm
