#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "benchmark/benchmark_options.h"
#include "benchmark/benchmark_report.h"
#include "benchmark/flight.h"
#include "mapper/probed_mapper.h"
#include "support/error_of.h"
#include "tools/reconstruction_report.h"

namespace dtsdf {
namespace {

std::string usageErrorOf(const std::vector<std::string>& arguments) {
  return errorOf<UsageError>([&] { parseBenchmarkOptions(arguments); });
}

TEST(BenchmarkOptions, ReadsWhatReconstructReads) {
  const BenchmarkOptions options = parseBenchmarkOptions(
      {"--raw", "frames/kitchen", "--frames", "::4", "--backend", "cpu", "--threads=2", "--set",
       "map/voxel_size_m=0.01", "mesh/colour=plain", "--report", "out.json"});
  EXPECT_EQ(options.raw_name, "frames/kitchen");
  EXPECT_EQ(options.recording.selection.step, 4u);
  EXPECT_EQ(*options.backend, "cpu");
  EXPECT_EQ(*options.threads, 2);
  EXPECT_EQ(options.settings.size(), 2u);
  EXPECT_EQ(options.report_path, "out.json");
}

TEST(BenchmarkOptions, WantsOneInput) {
  EXPECT_NE(usageErrorOf({}), "");
  EXPECT_NE(usageErrorOf({"--flight", "--tum", "dir"}), "");
  EXPECT_NE(usageErrorOf({"--tum", "dir", "--speed", "1"}), "");
  EXPECT_NE(usageErrorOf({"--flight", "--grow-to-gib", "0"}), "");
  EXPECT_EQ(usageErrorOf({"--flight", "--grow-to-gib", "0.5"}), "");
  EXPECT_EQ(usageErrorOf({"--gpu"}), "");
}

Measurement someMeasurement() {
  Measurement m;
  m.backend_name = "cpu (1 thread)";
  for (int i = 0; i < 4; ++i) {
    FrameTime time;
    time.total_ms = i == 0 ? 100.0 : i;
    time.processor_ms = 2.0 * time.total_ms;
    m.frames.push_back(time);
    Profile profile;
    profile.add(Stage::kFold, 2.0);
    m.stages.push_back(profile);
  }
  m.memory = {{"voxels", MemoryKind::kMap, 10, 20}, {"hash", MemoryKind::kIndices, 1, 2}};
  return m;
}

TEST(BenchmarkReport, LeavesTheFirstFrameOut) {
  const Report report = reportMeasurement(someMeasurement());
  const auto json = nlohmann::json::parse(report.json);
  EXPECT_EQ(json["first_frame_ms"], 100.0);
  EXPECT_EQ(json["total_ms"]["median"], 2.0);
  EXPECT_EQ(json["total_ms"]["worst"], 3.0);
  EXPECT_EQ(json["processor_ms"]["median"], 4.0);
}

TEST(BenchmarkReport, HasTheStagesThatTookAnyTime) {
  const auto json = nlohmann::json::parse(reportMeasurement(someMeasurement()).json);
  ASSERT_EQ(json["stages"].size(), 1u);
  EXPECT_EQ(json["stages"][0]["stage"], "fold");
  EXPECT_EQ(json["stages"][0]["ms"]["median"], 2.0);
}

TEST(BenchmarkReport, AddsMemoryUpByKind) {
  const auto memory = nlohmann::json::parse(reportMeasurement(someMeasurement()).json)["memory"];
  EXPECT_EQ(memory["map"]["used"], 11);
  EXPECT_EQ(memory["map"]["reserved"], 22);
}

TEST(BenchmarkReport, GroupsAFlightByWhatWasMapped) {
  std::vector<FrameTime> times(5);
  const double gib[] = {0.0, 0.2, 0.9, 1.1, 2.5};
  for (int i = 0; i < 5; ++i) {
    times[i].mapped_bytes = static_cast<size_t>(gib[i] * 1024 * 1024 * 1024);
    times[i].map_bytes = static_cast<size_t>(5 - i) << 20;
    times[i].total_ms = 10.0 * i;
  }
  const auto json = nlohmann::json::parse(reportFlight(times, someMeasurement()).json);
  ASSERT_EQ(json["by_gib"].size(), 3u);
  EXPECT_EQ(json["by_gib"][0]["frames"], 2);
  EXPECT_EQ(json["by_gib"][0]["total_ms"]["median"], 15.0);
  EXPECT_EQ(json["by_gib"][0]["map_mib"], 4.0);
  EXPECT_EQ(json["by_gib"][2]["gib"], 2);
}

TEST(Flight, DepthLeadsToTheGround) {
  const SourceFrame frame = renderFlightFrame(3.0);
  const DepthFrame& depth = frame.depth;
  for (const int u : {0, 100, 320, 639}) {
    for (const int v : {0, 240, 479}) {
      const double z = static_cast<const uint16_t*>(depth.data)[v * depth.width + u] *
                       static_cast<double>(depth.unit_m);
      const Eigen::Vector3d p_C((u - depth.intrinsics.cx) / depth.intrinsics.fx * z,
                                (v - depth.intrinsics.cy) / depth.intrinsics.fy * z, z);
      const Eigen::Vector3d p_W = depth.T_W_C * p_C;
      EXPECT_NEAR(p_W.z(), groundHeight(p_W.x(), p_W.y()), 1e-3);
    }
  }
}

TEST(Flight, GrowsTheMapToItsSize) {
  MapperParams params;
  params.backend = Backend::kCpu;
  params.threads = 1;
  params.map.voxel_size_m = 0.2f;
  const auto mapper = makeProbedMapper(params);
  const FlightPlan plan{size_t(1) << 20, 2.0};
  const std::vector<FrameTime> times = fly(*mapper, plan, [](size_t) {});
  ASSERT_GT(times.size(), 1u);
  EXPECT_GE(times.back().map_bytes, plan.map_bytes);
  EXPECT_LT(times[times.size() - 2].map_bytes, plan.map_bytes);
}

/// The way back is that of the way out, over the same ground.
TEST(Flight, Returns) {
  MapperParams params;
  params.backend = Backend::kCpu;
  params.map.voxel_size_m = 0.08f;
  const auto mapper = makeProbedMapper(params, Rules());
  FlightPlan plan{size_t(4) << 20, 2.0};
  plan.returns = true;
  const std::vector<FrameTime> times = fly(*mapper, plan, [](size_t) {});
  ASSERT_GE(times.size(), 4u);
  ASSERT_EQ(times.size() % 2, 0u);
  for (size_t i = 0; i < times.size(); ++i) {
    EXPECT_EQ(times[i].on_return, i >= times.size() / 2);
    EXPECT_EQ(times[i].mapped_bytes, times[times.size() - 1 - i].mapped_bytes);
  }
  EXPECT_LT(mapper->stats().map_bytes, size_t(6) << 20) << "nothing new on the way back";
}

/// What is behind is dropped: the flight goes on until all of it together has the size.
TEST(Flight, GoesOnWhileTheMapForgets) {
  MapperParams params;
  params.backend = Backend::kCpu;
  params.threads = 1;
  params.map.voxel_size_m = 0.2f;
  params.map.max_memory_mb = 1;
  params.map.keep_radius_m = 10.0f;
  const auto mapper = makeProbedMapper(params);
  const FlightPlan plan{size_t(3) << 20, 2.0};
  const std::vector<FrameTime> times = fly(*mapper, plan, [](size_t) {});
  EXPECT_GE(times.back().mapped_bytes, plan.map_bytes);
  EXPECT_EQ(mapper->stats().refused_blocks, 0u);
  for (const FrameTime& time : times) EXPECT_LT(time.map_bytes, size_t(1) << 20);
}

}  // namespace
}  // namespace dtsdf
