"""Builds from the clone that this folder lies in: conan create CLONE/packages/conan"""
import os
import re

from conan import ConanFile
from conan.tools.files import copy, load


class Springls(ConanFile):
    name = 'springls'
    description = 'Spring Level Sets: deformable surfaces in a C99 header'
    license = 'MIT OR Unlicense'
    package_type = 'header-library'
    no_copy_source = True

    def _clone(self):
        return os.path.join(self.recipe_folder, '..', '..')

    def set_version(self):
        numbers = re.findall(r'^#define SPRINGLS_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)$', load(self, os.path.join(self._clone(), 'springls.h')), re.M)
        self.version = '.'.join(numbers)

    def export_sources(self):
        for name in ('springls.h', 'springls_cl.h', 'LICENSE'):
            copy(self, name, self._clone(), self.export_sources_folder)

    def package(self):
        copy(self, '*.h', self.source_folder, os.path.join(self.package_folder, 'include'))
        copy(self, 'LICENSE', self.source_folder, os.path.join(self.package_folder, 'licenses'))

    def package_info(self):
        self.cpp_info.bindirs = self.cpp_info.libdirs = []
        self.cpp_info.set_property('cmake_target_name', 'springls::springls')
        if self.settings.get_safe('os') != 'Windows':
            self.cpp_info.system_libs = ['m']
