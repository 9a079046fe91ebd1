// server/cli/commands.h - one function a subcommand: options in, figures out.
#pragma once
#include <nlohmann/json.hpp>

#include "core/base/result.h"
#include "server/cli/options.h"
#include "server/cli/output.h"

namespace spinaltap::cli {

/// What a command gives: its figures, and whether it did what was asked (a replay may run and yet not be verified).
struct Outcome {
  jobs::Figures figures;
  bool done = true;
  std::string text = {};  ///< for people, instead of the figures one by one
};

[[nodiscard]] Result<Outcome> runPhantom(const PhantomOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runImport(const ImportOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runSegment(const SegmentOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runReconstruct(const ReconstructOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runExport(const ExportOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runFit(const FitOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runTradeoff(const TradeoffOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runPlan(const PlanOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runDrill(const DrillOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runReplay(const ReplayOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runServe(const ServeOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runLoad(const LoadOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runCases(const CasesOptions& options, ProgressBar& bar);
[[nodiscard]] Result<Outcome> runVersion();

/// "x,y,z" (also separated by blanks). @error InvalidArgument, naming `option`.
[[nodiscard]] Result<Vec3> parseVec3(const std::string& text, const char* option);
/// "auto" (rbf::kAutoSmoothing) or mm from 0. @error InvalidArgument.
[[nodiscard]] Result<double> parseSmoothing(const std::string& text);
[[nodiscard]] Result<store::Store> openStore(const std::string& data);

}  // namespace spinaltap::cli
