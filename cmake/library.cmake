# The library that other packages link against: the public headers, and one shared library with
# everything they declare. It is shared so that its users need only Eigen, not its other dependencies.
add_library(dtsdf_mapping SHARED
  $<TARGET_OBJECTS:dtsdf_core> $<TARGET_OBJECTS:dtsdf_mapper> $<TARGET_OBJECTS:dtsdf_io>
  $<TARGET_OBJECTS:dtsdf_datasets> $<TARGET_OBJECTS:dtsdf_depth_codes>
  $<TARGET_OBJECTS:dtsdf_colour_codes>)
if(DTSDF_CUDA)
  set_target_properties(dtsdf_mapping PROPERTIES LINKER_LANGUAGE CUDA CUDA_RUNTIME_LIBRARY Static)
else()
  set_target_properties(dtsdf_mapping PROPERTIES LINKER_LANGUAGE CXX)
endif()
add_library(dtsdf_mapping::dtsdf_mapping ALIAS dtsdf_mapping)
target_compile_features(dtsdf_mapping INTERFACE cxx_std_17)
target_include_directories(dtsdf_mapping INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
# Hides the symbols of static libraries, so that a program's own CUDA runtime does not clash with
# the one linked here.
target_link_libraries(dtsdf_mapping PUBLIC Eigen3::Eigen PRIVATE dtsdf_mapper dtsdf_datasets
                                    -Wl,--exclude-libs,ALL)
set_target_properties(dtsdf_mapping PROPERTIES
  VERSION ${PROJECT_VERSION}
  SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})

if(WITH_ROS)
  set(library_dir ${CATKIN_PACKAGE_LIB_DESTINATION})
  set(config_dir ${CATKIN_PACKAGE_SHARE_DESTINATION}/cmake)
  # catkin generates the package configuration, which includes the extras file.
  export(TARGETS dtsdf_mapping NAMESPACE dtsdf_mapping::
         FILE ${CATKIN_DEVEL_PREFIX}/share/${PROJECT_NAME}/cmake/dtsdf_mappingTargets.cmake)
else()
  set(library_dir ${CMAKE_INSTALL_LIBDIR})
  set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/${PROJECT_NAME})
  include(CMakePackageConfigHelpers)
  configure_file(cmake/dtsdf_mapping-extras.cmake.in dtsdf_mappingConfig.cmake COPYONLY)
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/dtsdf_mappingConfigVersion.cmake
                                   COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/dtsdf_mappingConfig.cmake
                ${PROJECT_BINARY_DIR}/dtsdf_mappingConfigVersion.cmake
          DESTINATION ${config_dir})
endif()
install(TARGETS dtsdf_mapping EXPORT dtsdf_mappingTargets LIBRARY DESTINATION ${library_dir})
install(EXPORT dtsdf_mappingTargets NAMESPACE dtsdf_mapping:: DESTINATION ${config_dir})
install(DIRECTORY include/dtsdf_mapping DESTINATION include FILES_MATCHING PATTERN "*.h")
