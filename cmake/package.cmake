# Builds a Debian package with CPack: run `scripts/package`, or cpack in a build folder.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "dtsdf_mapping developers")
file(READ ${PROJECT_SOURCE_DIR}/package.xml package_xml)
string(REGEX MATCH "<maintainer email=\"([^\"]+)\">([^<]+)<" maintainer "${package_xml}")
set(CPACK_PACKAGE_CONTACT "${CMAKE_MATCH_2} <${CMAKE_MATCH_1}>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Directional TSDF surface mapping: nodelet and programs")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION misc)

if(EXISTS /opt/ros/noetic)
  # Packages in the ROS archive do not declare their shared libraries, so dependencies are listed
  # here.
  set(CPACK_PACKAGE_NAME ros-noetic-dtsdf-mapping)
  set(CPACK_PACKAGING_INSTALL_PREFIX /opt/ros/noetic)
  set(CPACK_DEBIAN_PACKAGE_DEPENDS
      "ros-noetic-cv-bridge, ros-noetic-diagnostic-updater, ros-noetic-dynamic-reconfigure, \
ros-noetic-image-transport, ros-noetic-nodelet, ros-noetic-pcl-ros, ros-noetic-rosbag, \
ros-noetic-roscpp, ros-noetic-roslaunch, ros-noetic-rospy, ros-noetic-tf2-ros, \
ros-noetic-visualization-msgs, python3-numpy, python3-pil, liboctomap1.9, libpng16-16, \
libturbojpeg, libxxhash0, libyaml-cpp0.6, libzstd1")
  set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "ros-noetic-rviz, openmpi-bin")
else()
  set(CPACK_PACKAGE_NAME ros-dtsdf-mapping)
  set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PACKAGE_DEPENDS
      "libnodeletlib-tools, python3-numpy, python3-pil, python3-roslaunch, python3-rospy, python3-sensor-msgs, \
python3-visualization-msgs, python3-nav-msgs, python3-map-msgs, python3-diagnostic-msgs, \
python3-rosbag, rosout, tf2-tools")
  set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "rviz, openmpi-bin")
endif()

# catkin installs a workspace's setup files into the root of the prefix. In a package, they would
# overwrite ROS's own setup files, so they are removed from the prefixes of build and package.
set(catkin_files .catkin .rosinstall _setup_util.py env.sh setup.bash setup.sh setup.zsh
                 local_setup.bash local_setup.sh local_setup.zsh)
install(CODE "
  if(DEFINED ENV{DTSDF_PACKAGING})
    foreach(name ${catkin_files})
      file(REMOVE \"\$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/\${name}\"
                  \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/\${name}\")
    endforeach()
  endif()
")
include(CPack)
