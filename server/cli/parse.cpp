// The only file that includes CLI11: what the options are called, and what --help says of them.
#include <CLI/CLI.hpp>
#include <functional>

#include "core/drill/engine.h"
#include "core/session/scenes.h"
#include "server/cli/commands.h"
#include "server/cli/run.h"

namespace spinaltap::cli {
namespace {

constexpr const char* kDataHelp = "Data folder (default $SPINALTAP_DATA, else ~/.local/share/spinaltap)";
constexpr int kDone = 0, kFailed = 1, kWrongUsage = 2;

struct Program {
  CLI::App app{"Drill a vertebra from its CT. Coordinates are DICOM patient coordinates (LPS) in mm."};
  bool json = false;
  std::function<Result<Outcome>(ProgressBar&)> command;
};

/// Three numbers, or wrong usage.
const CLI::Validator kVec3(
    [](const std::string& text) {
      const auto value = parseVec3(text, "it");
      return value ? std::string() : value.error().message;
    },
    "X,Y,Z", "vec3");

/// One of the names that core has.
CLI::Validator oneOf(const std::vector<std::string_view>& names) {
  return CLI::IsMember(std::vector<std::string>(names.begin(), names.end()));
}

/// A subcommand with --json, that remembers what to run.
template <class Options>
CLI::App* add(Program& program, const char* name, const char* help, const std::shared_ptr<Options>& options,
              Result<Outcome> (*run)(const Options&, ProgressBar&)) {
  CLI::App* sub = program.app.add_subcommand(name, help);
  sub->add_flag("--json", program.json, "Print one JSON object");
  sub->callback(
      [&program, options, run] { program.command = [options, run](ProgressBar& bar) { return run(*options, bar); }; });
  return sub;
}

void addPhantom(Program& program) {
  auto o = std::make_shared<PhantomOptions>();
  CLI::App* sub = add(program, "phantom", "Write a DICOM stack of an invented L3, and its ground truth", o, runPhantom);
  sub->add_option("--out", o->out, "Folder to write: made when it is not there, refused when it holds files")
      ->required();
  sub->add_flag("--osteoporotic", o->osteoporotic, "60-90 HU inside a shell of 0.5 mm, not 140-230 HU in 1 mm");
  sub->add_option("--seed", o->seed, "Varies the anatomy and the noise")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  sub->add_option("--reduce", o->reduce, "Voxels this many times wider: small and quick")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
}

void addImport(Program& program) {
  auto o = std::make_shared<ImportOptions>();
  CLI::App* sub = add(program, "import", "Make a case of a CT; prints its id", o, runImport);
  sub->add_option("--from", o->from, "Folder of DICOM files, a multi-frame DICOM file, .nii or .nii.gz")->required();
  CLI::Option* label = sub->add_option("--label", o->label_file, "Label image on the CT's voxels, .nii or .nii.gz");
  sub->add_option("--label-value", o->label_value, "The value in it that is the vertebra")
      ->needs(label)
      ->capture_default_str();
  sub->add_option("--series", o->series, "Which of several series, numbered as in the refusal (1, 2, ...)");
  sub->add_option("--name", o->name, "What to call the case; nothing is taken from the files");
  sub->add_option("--data", o->data, kDataHelp);
}

void addSegment(Program& program) {
  auto o = std::make_shared<SegmentOptions>();
  CLI::App* sub =
      add(program, "segment", "Find the vertebra's voxels: from one click, or keep an imported label", o, runSegment);
  sub->add_option("CASE", o->case_id, "Case id")->required();
  CLI::Option* seed =
      sub->add_option("--seed", o->seed, "x,y,z in the middle of the wanted vertebral body")->check(kVec3);
  sub->add_option("--threshold", o->threshold_HU, "HU from which on it is bone (default: measured; 150 to grow)")
      ->needs(seed);
  sub->add_flag("--grow", o->grow, "Take all bone that hangs together with the seed, whatever bone it is")->needs(seed);
  sub->add_option("--data", o->data, kDataHelp);
}

void addReconstruct(Program& program) {
  auto o = std::make_shared<ReconstructOptions>();
  CLI::App* sub = add(program, "reconstruct", "Make the smooth surface, its mesh and the density", o, runReconstruct);
  sub->add_option("CASE", o->case_id, "Case id")->required();
  sub->add_option("--method", o->method,
                  "How the boundary is sampled; pixel and normal are the report's, from the label")
      ->check(oneOf({"pixel", "normal", "subvoxel"}))
      ->capture_default_str();
  sub->add_option("--sample-spacing", o->sample_spacing_mm, "Between boundary points, mm (default: by the voxels)");
  sub->add_option("--tolerance", o->tolerance_mm, "Centres are left out while the surface moves by less than this, mm")
      ->capture_default_str();
  sub->add_option("--smoothing", o->smoothing_mm,
                  "Averages the samples' noise, mm; 0 interpolates (default: as much as the noise found in them asks)");
  sub->add_option("--cell", o->cell_mm, "Size of the mesh's cells, mm")->capture_default_str();
  sub->add_option("--data", o->data, kDataHelp);
}

void addExport(Program& program) {
  auto o = std::make_shared<ExportOptions>();
  CLI::App* sub = add(program, "export", "Write the surface as STL or PLY, mm, patient LPS", o, runExport);
  sub->add_option("CASE", o->case_id, "Case id")->required();
  sub->add_option("--format", o->format, "stl (binary) or ply (binary, with normals)")
      ->required()
      ->check(CLI::IsMember({"stl", "ply"}));
  sub->add_option("--out", o->out, "File to write: whole or not at all")->required();
  sub->add_option("--simplify", o->simplify_mm, "Fewer triangles, nowhere farther than this from the surface, mm")
      ->check(CLI::Range(1e-3, 10.0));
  sub->add_option("--data", o->data, kDataHelp);
}

void addFit(Program& program) {
  auto o = std::make_shared<FitOptions>();
  CLI::App* sub =
      add(program, "fit", "Fit the implicit surface to any points, and evaluate it: the stage alone", o, runFit);
  sub->add_option("FILE", o->file, "Lines of x y z value (signed distance), or of x y z nx ny nz; any one unit")
      ->required();
  sub->add_option("--tolerance", o->tolerance_mm, "Every sample is met this closely, mm")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_option("--smoothing", o->smoothing, "auto: by the noise found in the samples; 0: none; else a ridge, mm")
      ->capture_default_str();
  sub->add_option("--reduce", o->reduce_mm,
                  "Leave out centres while the surface moves by less than this, mm; 0 keeps all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  sub->add_option("--offset", o->offset_mm,
                  "With normals: off-surface samples this far along them (default: the points' spacing)")
      ->check(CLI::PositiveNumber);
  sub->add_option("--evaluate", o->points, "Lines of x y z where the surface is to be evaluated");
  sub->add_option("--out", o->values, "Its values, a line a point (default: the points' file with .values added)");
  sub->add_flag("--gradients", o->gradients, "Write lines of value gx gy gz");
  sub->add_option("--evaluate-tolerance", o->evaluate_tolerance_mm,
                  "Of the values, mm (default: a hundredth of --tolerance)")
      ->check(CLI::PositiveNumber);
  sub->add_option("--threads", o->threads, "At most so many; 0: all")->capture_default_str();
}

/// `tradeoff --surface`.
void addSurfaceTradeoff(CLI::App* sub, TradeoffOptions& o, CLI::Option* surface) {
  CLI::Option* phantom_case =
      sub->add_option("CASE", o.case_id, "Case with a label (default: the phantom, whose truth is known)");
  phantom_case->needs(surface);
  sub->add_option("--method", o.methods, "Only these")->check(oneOf({"pixel", "normal", "subvoxel"}))->needs(surface);
  sub->add_option("--smoothing", o.smoothings,
                  "Each method with these (auto or mm) alone (default: the report's 0, 0.5 and 30, and ours in detail)")
      ->needs(surface);
  sub->add_option("--sample-spacing", o.sample_spacing_mm, "Between boundary points, mm (default: by the voxels)")
      ->check(CLI::PositiveNumber)
      ->needs(surface);
  sub->add_option("--out", o.out, "Folder for the pictures (SVG)")->needs(surface);
  sub->add_option("--reduce", o.reduce, "The phantom's voxels this many times wider: a quick look")
      ->excludes(phantom_case)
      ->needs(surface)
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  sub->add_flag("--osteoporotic", o.osteoporotic, "The phantom with a thin shell")
      ->excludes(phantom_case)
      ->needs(surface);
  sub->add_option("--data", o.data, kDataHelp)->needs(surface);
}

/// `tradeoff` alone.
void addDrillTradeoff(CLI::App* sub, TradeoffOptions& o, CLI::Option* surface, CLI::Option* haptics) {
  sub->add_option("--scene", o.scene, "The drill that is timed")
      ->check(oneOf(session::sceneNames()))
      ->excludes(surface, haptics)
      ->capture_default_str();
  sub->add_option("--spacing", o.drill.spacings_mm, "Of the points, mm: these, with commas")
      ->delimiter(',')
      ->check(CLI::Range(0.01, 1.0))
      ->excludes(surface, haptics)
      ->capture_default_str();
  sub->add_option("--threads", o.drill.threads, "That share a cycle: these, with commas")
      ->delimiter(',')
      ->check(CLI::Range(1, 2))
      ->excludes(surface, haptics)
      ->capture_default_str();
  sub->add_option("--rate", o.drill.rate_hz, "Cycles a second that are wanted")
      ->check(CLI::Range(1.0, 1e6))
      ->excludes(surface, haptics)
      ->capture_default_str();
  sub->add_option("--headroom", o.drill.headroom, "How many times quicker a p99.9 cycle is to be")
      ->check(CLI::Range(1.0, 1000.0))
      ->excludes(surface, haptics)
      ->capture_default_str();
  CLI::Option* length = sub->add_option("--length", o.drill.length_mm, "Of the path that is drilled, mm")
                            ->check(CLI::Range(7.0, session::kReportLength_mm))
                            ->excludes(surface, haptics)
                            ->capture_default_str();
  sub->add_flag("--full", o.full, "All of the report's path, 37.8 mm")->excludes(surface, haptics, length);
  sub->add_option("--repeats", o.drill.repeats, "Each cycle counts with its fastest of so many runs")
      ->check(CLI::Range(1, 100))
      ->excludes(surface, haptics)
      ->capture_default_str();
}

/// `tradeoff --haptics`.
void addHapticTradeoff(CLI::App* sub, TradeoffOptions& o, CLI::Option* haptics) {
  tradeoff::HapticGrid& grid = o.hands.grid;
  sub->add_option("--rates", grid.rates_hz, "Of the device's loop, Hz: these, with commas")
      ->delimiter(',')
      ->check(CLI::Range(50.0, 20'000.0))
      ->needs(haptics)
      ->capture_default_str();
  sub->add_option("--delays", grid.delays_ms, "Of the network, there and back, ms: these, with commas")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 1000.0))
      ->needs(haptics)
      ->capture_default_str();
  sub->add_option("--jitter", grid.jitter_ms,
                  "Of one network more, at the middle delay: each message later by up to, ms")
      ->check(CLI::Range(0.0, 1000.0))
      ->needs(haptics)
      ->capture_default_str();
  sub->add_option("--loss", grid.loss, "Of that network: share of the messages that is lost")
      ->check(CLI::Range(0.0, 0.9))
      ->needs(haptics)
      ->capture_default_str();
  sub->add_option("--seconds", grid.seconds, "Of drilling, each case")
      ->check(CLI::Range(0.5, 10.0))
      ->needs(haptics)
      ->capture_default_str();
}

void addTradeoff(Program& program) {
  auto o = std::make_shared<TradeoffOptions>();
  CLI::App* sub = add(program, "tradeoff",
                      "Measure what accuracy costs: of drilling, by spacing, precision and threads; of the surface; or "
                      "of what a hand feels",
                      o, runTradeoff);
  CLI::Option* surface =
      sub->add_flag("--surface", o->surface, "The surface instead: methods, smoothing, tolerance, reduction");
  CLI::Option* haptics =
      sub->add_flag("--haptics", o->haptics, "What a hand feels instead: rate and delay against force and stiffness")
          ->excludes(surface);
  sub->add_option("--html", o->html, "Write a page with charts here")->excludes(surface);
  addDrillTradeoff(sub, *o, surface, haptics);
  addHapticTradeoff(sub, *o, haptics);
  addSurfaceTradeoff(sub, *o, surface);
}

void addPlan(Program& program) {
  auto o = std::make_shared<PlanOptions>();
  CLI::App* sub = add(program, "plan", "Plan a path and make its points; prints its id", o, runPlan);
  sub->add_option("CASE", o->case_id, "Case id")->required();
  sub->add_option("--entry", o->entry, "x,y,z on the bone's surface")->required()->check(kVec3);
  sub->add_option("--target", o->target, "x,y,z where the tip shall end")->required()->check(kVec3);
  sub->add_option("--label", o->label, "What to call the path");
  sub->add_option("--bit-diameter", o->bit.diameter_mm, "mm")->capture_default_str();
  sub->add_option("--cone-length", o->bit.cone_length_mm, "Tip to where the cone meets the cylinder, mm")
      ->capture_default_str();
  sub->add_option("--bit-length", o->bit.length_mm, "Tip to the end of what is tested against bone, mm")
      ->capture_default_str();
  sub->add_option("--radius", o->radius_mm, "Of the cylinder of points around the path, mm")->capture_default_str();
  sub->add_option("--spacing", o->spacing_mm, "Between points, mm")->capture_default_str();
  sub->add_option("--lead", o->lead_mm, "The cylinder begins this far before the entry, mm")->capture_default_str();
  sub->add_option("--data", o->data, kDataHelp);
}

std::vector<std::string_view> handNames() {
  std::vector<std::string_view> names;
  for (const haptics::Holding holding : haptics::kHoldings) names.push_back(haptics::nameOf(holding));
  return names;
}

/// `drill --server`. @param elsewhere what has no meaning there.
void addRemoteDrill(CLI::App* sub, DrillOptions& o, const std::vector<CLI::Option*>& elsewhere) {
  CLI::Option* server =
      sub->add_option("--server", o.server, "http://HOST:PORT of one that runs: a simulated hand drills there, live");
  for (CLI::Option* option : elsewhere) server->excludes(option);
  sub->add_option("--hand", o.hand, "Who holds the drill")
      ->check(oneOf(handNames()))
      ->needs(server)
      ->capture_default_str();
  sub->add_option("--rate", o.rate_hz, "Of the device's loop, Hz")
      ->check(CLI::Range(50.0, 4000.0))
      ->needs(server)
      ->capture_default_str();
  sub->add_option("--feed", o.feed_mm_s, "What the hand means to advance, mm/s (leaning pushes instead)")
      ->check(CLI::Range(0.01, 100.0))
      ->needs(server)
      ->capture_default_str();
  sub->add_option("--start", o.start_mm, "Of the tip past the entry, mm (default: where the modelled bone begins)")
      ->check(CLI::Range(-50.0, 0.0))
      ->needs(server);
  sub->add_option("--depth", o.depth_mm, "Until the bit's tip is so far past the entry, mm (default: at the target)")
      ->check(CLI::Range(-50.0, 200.0))
      ->needs(server);
  sub->add_option("--seconds", o.seconds, "Or so long (default: three times what the feed needs, and 10 s)")
      ->check(CLI::Range(0.01, 36000.0))
      ->needs(server);
  sub->add_option("--max-force", o.max_force_N, "Of the device, N: forces are scaled to it (default: no limit)")
      ->check(CLI::Range(0.1, 1000.0))
      ->needs(server);
  sub->add_option("--damping", o.damping_N_s_mm,
                  "Of the device itself, N s/mm: with the rate, it bounds --stiffness (default: not known)")
      ->check(CLI::Range(1e-6, 10.0))
      ->needs(server);
  CLI::Option* lockstep =
      sub->add_flag("--lockstep", o.lockstep, "Not in real time: each pose waits for its answer; always the same drill")
          ->needs(server);
  sub->add_flag("--realtime", o.realtime, "Ask for SCHED_FIFO for this side of the line")
      ->needs(server)
      ->excludes(lockstep);
}

void addDrill(Program& program) {
  auto o = std::make_shared<DrillOptions>();
  CLI::App* sub = add(program, "drill", "Drill without a screen; prints the metrics, keeps a recording", o, runDrill);
  CLI::Option* path_case = sub->add_option("CASE", o->case_id, "Case id");
  CLI::Option* path = sub->add_option("PATH", o->path_id, "Path id");
  path_case->needs(path);
  CLI::Option* volume = sub->add_option("--volume", o->volume, "Instead of CASE PATH: the bare scene volume")
                            ->check(CLI::IsMember({"report"}))
                            ->excludes(path_case);
  CLI::Option* scene = sub->add_option("--scene", o->scene, "A scripted drill")->check(oneOf(session::sceneNames()));
  CLI::Option* trace =
      sub->add_option("--trace", o->trace, "CSV of poses: t_us, tip x y z, axis x y z (path frame, mm)");
  scene->excludes(trace);
  CLI::Option* engine = sub->add_option("--engine", o->engine, "How points are removed")
                            ->check(oneOf(drill::engineNames()))
                            ->capture_default_str();
  CLI::Option* cycles =
      sub->add_option("--cycles", o->cycles, "At most so many (default: to the end of the path or the trace)")
          ->check(CLI::NonNegativeNumber);
  CLI::Option* speed = sub->add_option("--speed", o->speed_rpm, "Of the bit, in turns a minute")->capture_default_str();
  sub->add_option("--stiffness", o->stiffness_N_mm,
                  "N/mm of the spring between hand and bit (default: none, the bit is held rigidly; on a server, 5)");
  CLI::Option* out = sub->add_option("--out", o->out, "Write the recording here");
  sub->add_option("--forces", o->forces, "Write force, torque and where the bit was, cycle by cycle, as CSV");
  CLI::Option* no_store = sub->add_flag("--no-store", o->no_store, "Do not keep the recording with the case");
  CLI::Option* data = sub->add_option("--data", o->data, kDataHelp);
  addRemoteDrill(sub, *o, {volume, scene, trace, engine, cycles, speed, out, no_store, data});
  sub->parse_complete_callback([o] {
    if (o->volume.empty() && o->path_id.empty()) throw CLI::RequiredError("CASE and PATH, or --volume report");
    if (o->scene.empty() && o->trace.empty() && o->server.empty()) {
      throw CLI::RequiredError("--scene, --trace or --server");
    }
  });
}

void addLoad(Program& program) {
  auto o = std::make_shared<LoadOptions>();
  CLI::App* sub = add(program, "load", "Drill with many trainees at once over sockets; prints round trips", o, runLoad);
  sub->add_option("--sessions", o->sessions, "Trainees")->check(CLI::Range(1, 64))->capture_default_str();
  sub->add_option("--rate", o->rate_hz, "Poses a second of each, Hz")
      ->check(CLI::Range(1.0, 20'000.0))
      ->capture_default_str();
  sub->add_option("--seconds", o->seconds, "How long")->check(CLI::Range(0.1, 3600.0))->capture_default_str();
  CLI::Option* server =
      sub->add_option("--server", o->server, "http://ADDRESS:PORT of one that runs (default: our own)");
  CLI::Option* path_case = sub->add_option("CASE", o->case_id, "Case id on that server");
  CLI::Option* path = sub->add_option("PATH", o->path_id, "Path id on that server");
  server->needs(path_case)->needs(path);
  path_case->needs(server);
  sub->add_flag("--rigid", o->rigid, "Hold the bit as a machine does, without a coupling");
  sub->add_flag("--realtime", o->realtime, "Our own server with serve --realtime, and the generator like it")
      ->excludes(server);
}

void addRest(Program& program) {
  auto replay = std::make_shared<ReplayOptions>();
  CLI::App* sub = add(program, "replay", "Run a recording again and compare the hashes", replay, runReplay);
  sub->add_option("FILE", replay->file, "A recording's file, or its id in the data folder")->required();
  sub->add_option("--data", replay->data, kDataHelp);

  auto serve = std::make_shared<ServeOptions>();
  sub = add(program, "serve", "Serve cases, pages and live drills until Ctrl-C", serve, runServe);
  sub->add_option("--data", serve->data, kDataHelp);
  sub->add_option("--port", serve->port, "0 takes a free one")->capture_default_str();
  sub->add_option("--address", serve->address, "Address to listen on")->capture_default_str();
  sub->add_option("--host", serve->hosts, "A further name by which browsers may call it, e.g. behind a proxy");
  sub->add_flag("--realtime", serve->realtime,
                "Live drills under SCHED_FIFO, memory locked, on a CPU of their own, as far as permitted");
  sub->add_option("--web", serve->web, "Folder of the built pages (default: found beside the program)");

  auto cases = std::make_shared<CasesOptions>();
  sub = add(program, "cases", "List what is in the data folder", cases, runCases);
  sub->add_option("--data", cases->data, kDataHelp);

  sub = program.app.add_subcommand("version", "What this is");
  sub->add_flag("--json", program.json, "Print one JSON object");
  sub->callback([&program] { program.command = [](ProgressBar&) { return runVersion(); }; });
}

/// CLI11's own message may run over several lines; ours is one.
int wrongUsage(const Program& program, const CLI::ParseError& error) {
  std::string name = "spinaltap";
  for (const CLI::App* sub : program.app.get_subcommands()) name += " " + sub->get_name();
  printError(std::string(error.what()) + " (see " + name + " --help)");
  return kWrongUsage;
}

Result<Outcome> outcomeOf(const Program& program, ProgressBar& bar) {
  try {
    return program.command(bar);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::Limit, "not enough memory");
  } catch (const std::exception& error) {
    return fail(ErrorCode::Io, error.what());
  }
}

int execute(const Program& program) {
  ProgressBar bar;
  const auto outcome = outcomeOf(program, bar);
  bar.wipe();
  if (!outcome) {
    printError(outcome.error().message);
    return kFailed;
  }
  if (!outcome->text.empty() && !program.json) {
    std::fputs(outcome->text.c_str(), stdout);
  } else if (!outcome->figures.is_null()) {
    print(outcome->figures, program.json);
  }
  return outcome->done ? kDone : kFailed;
}

}  // namespace

int run(int argc, char** argv) {
  Program program;
  program.app.name("spinaltap");
  program.app.require_subcommand(1);
  program.app.set_version_flag("--version", SPINALTAP_VERSION);
  addPhantom(program);
  addImport(program);
  addSegment(program);
  addReconstruct(program);
  addExport(program);
  addFit(program);
  addTradeoff(program);
  addPlan(program);
  addDrill(program);
  addLoad(program);
  addRest(program);
  try {
    program.app.parse(argc, argv);
  } catch (const CLI::Success& wanted) {  // --help, --version
    return program.app.exit(wanted);
  } catch (const CLI::ParseError& error) {
    return wrongUsage(program, error);
  }
  return execute(program);
}

}  // namespace spinaltap::cli
