/// Displays the mesh in RViz's render panel. Waits for TRIANGLES triangles, rotates the view for
/// SECONDS, measures the frame rate, and saves a picture of the configured view.
///   show_mesh CONFIG TRIANGLES SECONDS PICTURE.png [DISTANCE_M [NAME=VALUE]...]
/// NAME is a property of the display "Mesh", or Pitch for the view. Prints "LOADED_S TRIANGLES
/// PICTURES_PER_S CPU_MS_PER_PICTURE", where the CPU time is summed over all threads. Exits with 1
/// if the triangles do not arrive within five minutes.
#include <OgreRenderTarget.h>
#include <OgreRenderWindow.h>
#include <ros/ros.h>
#include <rviz/config.h>
#include <rviz/display.h>
#include <rviz/display_group.h>
#include <rviz/properties/property.h>
#include <rviz/render_panel.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <rviz/visualization_manager.h>
#include <rviz/yaml_config_reader.h>
#include <QApplication>
#include <QElapsedTimer>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <stdexcept>
#include <string>

namespace {

constexpr int kLoadTimeout_s = 300;
constexpr int kWidth = 1280, kHeight = 900;

class Viewer {
 public:
  explicit Viewer(const QString& config_file) : manager_(&panel_) {
    panel_.resize(kWidth, kHeight);
    panel_.show();
    panel_.initialize(manager_.getSceneManager(), &manager_);
    manager_.initialize();
    rviz::YamlConfigReader reader;
    rviz::Config config;
    reader.readFile(config, config_file);
    manager_.load(config.mapGetChild("Visualization Manager"));
    for (int i = manager_.getRootDisplayGroup()->numDisplays() - 1; i >= 0; --i) {
      rviz::Display* const display = manager_.getRootDisplayGroup()->getDisplayAt(i);
      if (display->getName() != "Mesh") display->setEnabled(false);
    }
    manager_.startUpdate();
  }

  void setDistance(float distance_m) { view()->subProp("Distance")->setValue(distance_m); }
  void setYaw(double yaw) { view()->subProp("Yaw")->setValue(yaw); }
  double yaw() { return view()->subProp("Yaw")->getValue().toDouble(); }

  /// A property of the display "Mesh".
  rviz::Property* option(const QString& name) {
    rviz::DisplayGroup* const group = manager_.getRootDisplayGroup();
    for (int i = 0; i < group->numDisplays(); ++i) {
      if (group->getDisplayAt(i)->getName() == "Mesh") return group->getDisplayAt(i)->subProp(name);
    }
    throw std::runtime_error("the configuration has no display named Mesh");
  }
  void setOption(const QString& name, const QString& value) {
    const bool is_switch = value == "true" || value == "false";
    rviz::Property* const property = name == "Pitch" ? view()->subProp(name) : option(name);
    property->setValue(is_switch ? QVariant(value == "true") : QVariant(value));
  }

  /// Draws one picture of everything received so far.
  void draw() {
    manager_.queueRender();
    QApplication::processEvents(QEventLoop::AllEvents, 20);
  }
  size_t triangles() { return panel_.getRenderWindow()->getStatistics().triangleCount; }
  uint64_t pictures() { return manager_.getFrameCount(); }
  void save(const std::string& path) { panel_.getRenderWindow()->writeContentsToFile(path); }

 private:
  rviz::ViewController* view() { return manager_.getViewManager()->getCurrent(); }

  rviz::RenderPanel panel_;
  rviz::VisualizationManager manager_;
};

double secondsOf(const QElapsedTimer& timer) {
  return 0.001 * static_cast<double>(timer.elapsed());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) return 2;
  ros::init(argc, argv, "show_mesh", ros::init_options::AnonymousName);
  QApplication app(argc, argv);
  Viewer viewer(argv[1]);
  const size_t wanted = std::strtoul(argv[2], nullptr, 10);
  if (argc > 5) viewer.setDistance(std::strtof(argv[5], nullptr));
  const QVariant detail = viewer.option("Detail")->getValue();
  viewer.setOption("Detail", "0");  // full detail, so that all triangles are counted

  QElapsedTimer timer;
  timer.start();
  while (viewer.triangles() < wanted && secondsOf(timer) < kLoadTimeout_s) viewer.draw();
  const double loaded_s = secondsOf(timer);
  const size_t triangles = viewer.triangles();
  viewer.option("Detail")->setValue(detail);
  for (int i = 6; i < argc; ++i) {
    const QString option(argv[i]);
    viewer.setOption(option.section('=', 0, 0), option.section('=', 1));
  }
  for (int i = 0; i < 3; ++i) viewer.draw();

  const double duration_s = std::strtod(argv[3], nullptr), yaw = viewer.yaw();
  timer.restart();
  const uint64_t before = viewer.pictures();
  const std::clock_t cpu_before = std::clock();
  while (secondsOf(timer) < duration_s) {
    viewer.setYaw(yaw + 0.5 * secondsOf(timer));
    viewer.draw();
  }
  const auto pictures = static_cast<double>(viewer.pictures() - before);
  const double pictures_per_s = pictures / secondsOf(timer);
  const double cpu_ms =
      1000.0 * static_cast<double>(std::clock() - cpu_before) / CLOCKS_PER_SEC / pictures;
  viewer.setYaw(yaw);
  timer.restart();  // full detail returns once the view has been still for a while
  while (secondsOf(timer) < 2.0) viewer.draw();
  viewer.save(argv[4]);
  std::printf("%.2f %zu %.2f %.0f\n", loaded_s, triangles, pictures_per_s, cpu_ms);
  return triangles >= wanted ? 0 : 1;
}
