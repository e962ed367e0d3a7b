// bedflow-engine: one job folder in; events, statistics and checkpoints out.
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <new>

#include "base/stop.h"
#include "case/case_scene.h"
#include "parallel/comm.h"
#include "plan.h"
#include "plan_answers.h"
#include "report/plan_report.h"
#include "report/snapshot.h"
#include "run.h"

namespace {

using bedflow::Comm;
using bedflow::Reason;

struct Arguments {
  std::string folder, plan_case, checkpoint;
  std::uint32_t epoch = 0;
  std::optional<std::uint64_t> from;
  int ranks = 1;
  std::uint32_t most = 0;
  bool plans = false;
};

// Plans need no other rank: MPI is not started for them.
int plan(const Arguments& arguments) {
  try {
    if (arguments.plans) return bedflow::answer_plans(std::cin, std::cout) ? 0 : static_cast<int>(Reason::internal);
    std::cout << plan_report(make_plan(bedflow::read_scene(arguments.plan_case), arguments.ranks));
    return 0;
  } catch (const bedflow::Stop& stop) {
    std::cerr << "bedflow-engine: " << stop.what() << "\n";
    return static_cast<int>(stop.reason);
  } catch (const std::exception& error) {
    std::cerr << "bedflow-engine: " << error.what() << "\n";
    return static_cast<int>(Reason::internal);
  }
}

int carry_out(const Comm& world, const Arguments& arguments) {
  if (!arguments.checkpoint.empty()) {
    if (world.root()) std::cout << bedflow::snapshot_of(arguments.checkpoint, arguments.most);
    return 0;
  }
  return static_cast<int>(run(world, {arguments.folder, arguments.epoch, arguments.from}));
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "bedflow-engine runs the job of a folder (case.txtpb, and job.txtpb if there is one) to its end.\n"
      "Under mpirun on as many ranks as wished; a folder with checkpoints goes on from the newest good one.");
  app.set_version_flag("--version", BEDFLOW_VERSION);
  app.add_option("folder", arguments.folder, "job folder")->check(CLI::ExistingDirectory);
  app.add_option("--epoch", arguments.epoch, "attempt of the job that this is (given by the server)");
  app.add_option("--from", arguments.from, "go on from the checkpoint of this step");
  app.add_option("--plan", arguments.plan_case, "print the plan of a case file (PlanReport, text format) and stop")
      ->check(CLI::ExistingFile);
  app.add_flag("--plans", arguments.plans, "answer questions for plans on the standard input until it ends (plan_answers.h)");
  app.add_option("--ranks", arguments.ranks, "ranks that --plan is for")->check(CLI::Range(1, 100000));
  app.add_option("--snapshot", arguments.checkpoint, "print what a picture needs of a checkpoint (Snapshot, binary) and stop")
      ->check(CLI::ExistingFile);
  app.add_option("--most", arguments.most, "most particles in the snapshot; 0: all");
  CLI11_PARSE(app, argc, argv);
  if (arguments.folder.empty() && arguments.plan_case.empty() && arguments.checkpoint.empty() && !arguments.plans) {
    std::cerr << "bedflow-engine: a job folder is needed; see --help\n";
    return static_cast<int>(Reason::invalid_case);
  }

  if (arguments.plans || !arguments.plan_case.empty()) return plan(arguments);

  mallopt(M_MMAP_THRESHOLD, 2 << 20);  // large arrays that particles have outgrown go back to the system;
  mallopt(M_TRIM_THRESHOLD, 8 << 20);  // what every rebuild of the pair list takes and gives stays

  const bedflow::MpiSession session(&argc, &argv);
  const Comm world = Comm::world();
  try {
    return carry_out(world, arguments);
  } catch (const bedflow::Stop& stop) {  // known to all ranks alike
    if (world.root()) std::cerr << "bedflow-engine: " << stop.what() << "\n";
    return static_cast<int>(stop.reason);
  } catch (const std::bad_alloc&) {
    std::cerr << "bedflow-engine: rank " << world.rank() << " is out of memory\n";
    world.abort(static_cast<int>(Reason::out_of_memory));
  } catch (const std::exception& error) {
    std::cerr << "bedflow-engine: rank " << world.rank() << ": " << error.what() << "\n";
    world.abort(static_cast<int>(Reason::internal));
  }
}
