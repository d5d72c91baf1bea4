// runTiles(): process 0 hands out tiles and makes some itself; each tile is a child process.
#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <deque>
#include <memory>
#include <stdexcept>
#include <thread>

#include "io/atomic_file.h"
#include "params/printable.h"
#include "program/stopwatch.h"
#include "threads/parallel.h"
#include "tiles/child_process.h"
#include "tiles/run_report.h"
#include "tiles/run_tiles.h"
#include "tiles/tile_folder.h"
#include "tiles/tile_queue.h"

namespace dtsdf {
namespace {

constexpr int kNoTile = -1;
constexpr int kMade = 0, kFailed = 1;
enum Tag { kTagAsk, kTagTile };

/// Waiting costs no core: those that wait share it with those that fuse.
void rest() { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }

/// This process among those of the job.
class Job {
 public:
  Job() {
    MPI_Init(nullptr, nullptr);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    MPI_Comm here;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &here);
    MPI_Comm_rank(here, &rank_here_);
    MPI_Comm_size(here, &size_here_);
    MPI_Comm_free(&here);
  }
  ~Job() { MPI_Finalize(); }
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }
  int rankHere() const { return rank_here_; }  ///< Among those of the same machine.
  int sizeHere() const { return size_here_; }

 private:
  int rank_ = 0, size_ = 1, rank_here_ = 0, size_here_ = 1;
};

/// The tile that this process makes.
class Worker {
 public:
  Worker(const RunRequest& request, const Job& job) : request_(request) {
    const int share = std::max(1, threadCount(0) / job.sizeHere());
    options_ = {"--threads", std::to_string(request.options.threads.value_or(share))};
    if (const auto& backend = request.options.backend) {
      options_.insert(options_.end(), {"--backend", *backend});
    }
    const std::vector<std::string> gpus = visibleGpus();
    if (gpus.size() > 1) gpu_ = gpus[static_cast<size_t>(job.rankHere()) % gpus.size()];
  }

  bool isIdle() const { return child_ == nullptr; }
  size_t tile() const { return tile_; }

  void start(size_t tile) {
    const std::string& folder = request_.merge.folder;
    ChildRequest child;
    child.arguments = {"fuse", folder, std::to_string(tile), "--end-with",
                       std::to_string(getpid())};
    child.arguments.insert(child.arguments.end(), options_.begin(), options_.end());
    child.log_path = tilePath(folder, tile, ".log");
    child.visible_gpu = gpu_;
    prepareOutputFile(child.log_path);  // makes the folder
    tile_ = tile;
    child_ = std::make_unique<ChildProcess>(child);
  }

  /// How the tile has ended, or nothing: kMade or kFailed.
  std::optional<int> ended() {
    const std::optional<std::string> how = child_->ended();
    if (!how) return std::nullopt;
    child_.reset();
    if (how->empty()) return kMade;
    std::fprintf(stderr, "tiles: warning: tile %zu failed (%s); see %s\n", tile_, how->c_str(),
                 tilePath(request_.merge.folder, tile_, ".log").c_str());
    return kFailed;
  }

 private:
  const RunRequest& request_;
  std::vector<std::string> options_;
  std::string gpu_;
  size_t tile_ = 0;
  std::unique_ptr<ChildProcess> child_;
};

/// Makes what process 0 hands out, until it says that there is no more.
void serve(Worker& worker) {
  std::array<int, 2> ask = {kNoTile, kMade};  // what was made, and how it has ended
  for (;;) {
    MPI_Send(ask.data(), 2, MPI_INT, 0, kTagAsk, MPI_COMM_WORLD);
    int there = 0;
    while (MPI_Iprobe(0, kTagTile, MPI_COMM_WORLD, &there, MPI_STATUS_IGNORE), there == 0) rest();
    int tile = kNoTile;
    MPI_Recv(&tile, 1, MPI_INT, 0, kTagTile, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    if (tile == kNoTile) return;
    worker.start(static_cast<size_t>(tile));
    std::optional<int> ended;
    while (!(ended = worker.ended())) rest();
    ask = {tile, *ended};
  }
}

/// Process 0.
class Master {
 public:
  Master(const RunRequest& request, const Job& job)
      : folder_(request.merge.folder),
        plan_(loadPlan(folder_)),
        queue_(plan_.plan, doneTiles()),
        worker_(request, job),
        others_(job.size() - 1) {
    report_.processes = job.size();
  }

  const LoadedPlan& plan() const { return plan_; }

  void makeTiles() {
    std::printf("%zu tiles, %zu of them done already\n", queue_.count(), queue_.doneCount());
    static_cast<void>(std::fflush(stdout));
    while (!queue_.isOver()) {
      bool idle = !workMyself();
      while (const std::optional<int> other = hearOthers()) {
        waiting_.push_back(*other);
        idle = false;
      }
      idle = !handOut() && idle;
      if (idle) rest();
    }
    report_.fuse_s = watch_.seconds();
    dismissOthers();
  }

  void merge(const MergeRequest& request) {
    const std::string failed = describeFailed();
    if (!failed.empty()) fail(failed);
    if (!request.mesh_path.empty() || !request.map_path.empty()) {
      try {
        report_.merged = mergeTiles(request, plan_);
      } catch (const std::exception& error) {
        fail(errorText(error));
      }
    }
    saveReport(report_, folder_, plan_, queue_);
  }

  const MergeResult& merged() const { return report_.merged; }

 private:
  std::vector<bool> doneTiles() const {
    std::vector<bool> done;
    for (size_t i = 0; i < plan_.plan.tiles.size(); ++i) {
      done.push_back(missingOfTile(folder_, i, plan_.id).empty());
    }
    return done;
  }

  [[noreturn]] void fail(const std::string& why) {
    report_.failure = why;
    saveReport(report_, folder_, plan_, queue_);
    throw std::runtime_error(why);
  }

  void noteEnd(size_t tile, int ended, int process) {
    const bool again = queue_.finish(tile, ended == kMade);
    if (ended == kMade) report_.maker[tile] = process;
    std::string line = "tile " + std::to_string(tile) +
                       (ended == kMade ? " is done"
                        : again        ? " is tried again"
                                       : " failed twice") +
                       "; " + std::to_string(queue_.doneCount()) + " of " +
                       std::to_string(queue_.count());
    if (const std::optional<double> left_s = queue_.secondsLeft(watch_.seconds())) {
      line += ", about " + std::to_string(static_cast<long>(*left_s + 0.5)) + " s left";
    }
    std::printf("%s\n", line.c_str());
    static_cast<void>(std::fflush(stdout));
  }

  /// @return whether anything was done.
  bool workMyself() {
    if (!worker_.isIdle()) {
      const size_t tile = worker_.tile();
      const std::optional<int> ended = worker_.ended();
      if (!ended) return false;
      noteEnd(tile, *ended, 0);
    }
    const std::optional<size_t> tile = queue_.next();
    if (tile) worker_.start(*tile);
    return tile.has_value();
  }

  /// The number of a process that asks for work.
  std::optional<int> hearOthers() {
    int there = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, kTagAsk, MPI_COMM_WORLD, &there, &status);
    if (there == 0) return std::nullopt;
    std::array<int, 2> ask{};
    MPI_Recv(ask.data(), 2, MPI_INT, status.MPI_SOURCE, kTagAsk, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    if (ask[0] != kNoTile) noteEnd(static_cast<size_t>(ask[0]), ask[1], status.MPI_SOURCE);
    return status.MPI_SOURCE;
  }

  static void send(int process, int tile) {
    MPI_Send(&tile, 1, MPI_INT, process, kTagTile, MPI_COMM_WORLD);
  }

  /// @return whether any tile was.
  bool handOut() {
    bool any = false;
    while (!waiting_.empty()) {
      const std::optional<size_t> tile = queue_.next();
      if (!tile) return any;
      send(waiting_.front(), static_cast<int>(*tile));
      waiting_.pop_front();
      any = true;
    }
    return any;
  }

  void dismissOthers() {
    for (int dismissed = 0; dismissed < others_;) {
      for (; !waiting_.empty(); waiting_.pop_front(), ++dismissed) send(waiting_.front(), kNoTile);
      if (const std::optional<int> other = hearOthers()) {
        waiting_.push_back(*other);
      } else {
        rest();
      }
    }
  }

  std::string describeFailed() const {
    std::string text;
    for (const size_t tile : queue_.failed()) {
      const TileState state = stateOf(folder_, tile, plan_.id);
      text += (text.empty() ? "" : "; ") + std::to_string(tile) + ": " +
              (state.stage == TileStage::kFailed ? state.why : "its process died");
    }
    if (text.empty()) return text;
    return std::to_string(queue_.failed().size()) + " tiles failed twice (" + text +
           "); run the same command again to retry them";
  }

  const std::string folder_;
  const LoadedPlan plan_;
  TileQueue queue_;
  Worker worker_;
  const int others_;
  const Stopwatch watch_;
  std::deque<int> waiting_;  ///< Processes that wait for work.
  RunReport report_;
};

/// Others may wait for what this process does: if it fails, all end.
template <class Action>
void together(const Action& action) {
  try {
    action();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tiles: error: %s\n", errorText(error).c_str());
    static_cast<void>(std::fflush(nullptr));
    MPI_Abort(MPI_COMM_WORLD, 1);
  }
}

}  // namespace

void runTiles(const RunRequest& request) {
  const Job job;
  if (job.rank() != 0) {
    together([&] {
      Worker worker(request, job);
      serve(worker);
    });
    return;
  }
  std::unique_ptr<Master> master;
  together([&] {
    master = std::make_unique<Master>(request, job);
    master->makeTiles();
  });
  // The others have gone.
  master->merge(request.merge);
  printMerged(request.merge, master->merged());
}

}  // namespace dtsdf
