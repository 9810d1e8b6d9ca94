"""deploy/engine-package and deploy/set-version: what engines and package managers would find. Neither Unity nor Unreal runs here, so
this checks what can be read. Stand-ins take the place of the C libraries, because only their places and names matter.
    engine_package_test.py          needs deploy/install csharp
    engine_package_test.py real     with the libraries of build/engine, which deploy/engine-library all has made; also loads those of the
                                    packages for Linux and Windows (deploy/install engine-test), and prints sizes
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "deploy/engine-package"
LIBRARIES = {"windows-x86_64": "liblpdeform_client.dll", "linux-x86_64": "liblpdeform_client.so.1", "linux-aarch64": "liblpdeform_client.so.1",
             "macos": "liblpdeform_client.1.dylib"}
VERSION = re.search(r"^project\(lpdeform VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]
ENGINE = ROOT / "build/engine"
IS_REAL = "real" in sys.argv[1:]


def library(platform, name=None):
    """What the packages are made of."""
    name = name or LIBRARIES[platform]
    return (ENGINE / platform / "out" / name).read_bytes() if IS_REAL else f"{platform} {name}".encode()


class WithLibraries(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.work)
        for platform, name in LIBRARIES.items():
            (cls.work / "engine" / platform / "out").mkdir(parents=True)
            (cls.work / "engine" / platform / "out" / name).write_bytes(library(platform))
        (cls.work / "engine/windows-x86_64/out/lpdeform_client.lib").write_bytes(library("windows-x86_64", "lpdeform_client.lib"))

    def expect_that_each_loads(self, files):
        """files: {platform: library}. Those that nothing here loads have to be left out."""
        if IS_REAL:
            for platform, content in files.items():
                (self.work / "loaded.so").write_bytes(content)
                print(f"{self.id()}: {platform} {len(content) / 1e6:.2f} MB, loads as {version_of(self.work, platform)}")

    def expect_no_link_leads_outside(self, files):
        """Of pages of a package: {place: text}."""
        pages = {place: text for place, text in files.items() if place.endswith(".md")}
        self.assertIn("README.md", pages)
        for place, text in pages.items():
            for link in re.findall(r"\]\(([^)\s]+)\)", text):
                if not re.match(r"https?://|#", link):
                    self.assertIn(str(pathlib.PurePosixPath(place).parent / link.split("#")[0]), files, place)

    def pack(self, kind, name, libraries="engine"):
        out = self.work / name
        made = subprocess.run([PACKAGE, kind, out, "--libraries", self.work / libraries], capture_output=True, text=True, check=False)
        self.assertEqual(made.returncode, 0, made.stderr)
        if IS_REAL:
            print(f"{name}: {sum(file.stat().st_size for file in ([out] if out.is_file() else out.rglob('*'))) / 1e6:.2f} MB")
        return out


COMPILERS = {"linux-x86_64": [ENGINE / "linux-x86_64/bin/cc"], "linux-aarch64": [ENGINE / "linux-aarch64/bin/cc"],
             "windows-x86_64": ["x86_64-w64-mingw32-gcc"]}
RUNNERS = {"linux-x86_64": [], "linux-aarch64": ["qemu-aarch64-static", "-L", "/usr/aarch64-linux-gnu"], "windows-x86_64": ["/usr/lib/wine/wine64"]}
PROGRAM = """
#include <stdio.h>
#ifdef _WIN32
#include <windows.h>
#define OPEN(file) LoadLibraryA(file)
#define FIND(library) GetProcAddress(library, "lpdeform_version")
#else
#include <dlfcn.h>
#define OPEN(file) dlopen(file, RTLD_NOW)
#define FIND(library) dlsym(library, "lpdeform_version")
#endif
int main(int count, char** arguments) {
  void* const library = OPEN(arguments[1]);
  if (count != 2 || !library) return 1;
  puts(((const char* (*)(void))FIND(library))());
  return 0;
}
"""


def version_of(work, platform):
    """What work/loaded.so, a library for this platform, says of itself."""
    (work / "load.c").write_text(PROGRAM)
    subprocess.run([*COMPILERS[platform], work / "load.c", "-o", work / "load.exe", *(["-ldl"] if "linux" in platform else [])], check=True)
    return subprocess.run([*RUNNERS[platform], work / "load.exe", "./loaded.so"], cwd=work, capture_output=True, text=True, check=True,
                          env=os.environ | {"WINEDEBUG": "-all", "WINEPREFIX": str(ENGINE / "wine")}).stdout.strip()


class Unity(WithLibraries):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with tarfile.open(cls().pack("unity", "lpdeform.tgz")) as tar:
            contents = {entry.name.removeprefix("package/"): tar.extractfile(entry).read() for entry in tar}
            cls.roots = {entry.name.split("/")[0] for entry in tar}
        cls.libraries = {place: content for place, content in contents.items() if place.startswith("Plugins/") and not place.endswith(".meta")}
        cls.files = {place: "" if place in cls.libraries else content.decode() for place, content in contents.items()}

    def meta(self, place):
        return self.files[place + ".meta"]

    def test_the_manifest_is_in_the_folder_package(self):
        self.assertEqual(self.roots, {"package"})
        manifest = json.loads(self.files["package.json"])
        self.assertRegex(manifest["name"], r"^[a-z0-9-]+(\.[a-z0-9-]+){2,}$")
        self.assertEqual(manifest["version"], VERSION)
        for place in ("README.md", "CHANGELOG.md", "LICENSE.md"):
            self.assertIn(place, self.files)

    def test_its_pages_need_nothing_else(self):
        self.expect_no_link_leads_outside(self.files)

    def test_each_sample_is_there(self):
        samples = json.loads(self.files["package.json"])["samples"]
        self.assertTrue(samples)
        for sample in samples:
            self.assertTrue(any(place.startswith(sample["path"] + "/") and place.endswith(".cs") for place in self.files), sample)

    def test_each_file_and_folder_that_unity_sees_has_an_id_of_its_own(self):
        places = {place for place in self.files if not place.endswith(".meta")}
        for place in list(places):
            places |= {str(parent) for parent in list(pathlib.PurePosixPath(place).parents)[:-1] if parent.name != "Samples~"}
        self.assertEqual({place + ".meta" for place in places}, {place for place in self.files if place.endswith(".meta")})
        ids = [re.search(r"^guid: ([0-9a-f]{32})$", self.meta(place), re.M)[1] for place in places]
        self.assertEqual(len(set(ids)), len(ids))

    def test_ids_stay_the_same(self):
        # Scenes of users refer to this one: it may never change.
        self.assertIn("guid: 527790c9a5dd9f9eb73caa8fe5aa15fa", self.meta("Runtime/Unity/LpdeformMesh.cs"))

    def test_the_same_input_gives_the_same_bytes(self):
        self.assertEqual(self.pack("unity", "again.tgz").read_bytes(), (self.work / "lpdeform.tgz").read_bytes())

    def test_references_of_assemblies_are_to_assemblies_of_the_package(self):
        assemblies = {json.loads(text)["name"]: json.loads(text) for place, text in self.files.items() if place.endswith(".asmdef")}
        self.assertEqual(set(assemblies), {"Lpdeform", "Lpdeform.Unity", "Lpdeform.SwingingBar"})
        for assembly in assemblies.values():
            self.assertLessEqual(set(assembly.get("references", [])), set(assemblies))

    def test_each_library_is_for_one_target_and_its_editor(self):
        for place, target, processor, editor in (
                ("Plugins/Windows/x86_64/lpdeform_client.dll", "Standalone: Win64", "x86_64", "Windows"),
                ("Plugins/Linux/x86_64/liblpdeform_client.so", "Standalone: Linux64", "x86_64", "Linux"),
                ("Plugins/macOS/liblpdeform_client.dylib", "Standalone: OSXUniversal", "AnyCPU", "OSX")):
            entries = re.split(r"^  - first:\n", self.meta(place), flags=re.M)[1:]
            settings = {entry.splitlines()[0].strip(): entry for entry in entries}
            self.assertEqual(set(settings), {"Any:", "Editor: Editor", target}, place)
            self.assertIn("enabled: 0", settings["Any:"])
            self.assertIn("enabled: 1", settings[target])
            self.assertIn(f"CPU: {processor}", settings[target])
            self.assertIn("enabled: 1", settings["Editor: Editor"])
            self.assertIn(f"OS: {editor}", settings["Editor: Editor"])

    def test_the_libraries_are_those_that_were_made(self):
        made = {"Plugins/Windows/x86_64/lpdeform_client.dll": "windows-x86_64", "Plugins/Linux/x86_64/liblpdeform_client.so": "linux-x86_64",
                "Plugins/macOS/liblpdeform_client.dylib": "macos"}
        self.assertEqual({place: library(platform) for place, platform in made.items()}, self.libraries)
        self.expect_that_each_loads({made[place]: content for place, content in self.libraries.items() if "macOS" not in place})

    def test_the_libraries_have_the_name_that_the_code_imports(self):
        name = re.search(r'const string Library = "(\w+)"', self.files["Runtime/Lpdeform/Native.cs"])[1]
        for place in self.libraries:
            self.assertIn(pathlib.PurePosixPath(place).stem, (name, "lib" + name))

    def test_missing_libraries_are_left_out_and_said(self):
        shutil.copytree(self.work / "engine/linux-x86_64", self.work / "one/linux-x86_64")
        made = subprocess.run([PACKAGE, "unity", self.work / "one.tgz", "--libraries", self.work / "one"], capture_output=True, text=True,
                              check=True)
        self.assertIn("without windows-x86_64, macos", made.stdout)
        (self.work / "none").mkdir()
        none = subprocess.run([PACKAGE, "unity", self.work / "none.tgz", "--libraries", self.work / "none"], capture_output=True, text=True,
                              check=False)
        self.assertEqual(none.returncode, 1)
        self.assertIn("deploy/engine-library", none.stderr)
        self.assertFalse((self.work / "none.tgz").exists())


# What UnrealBuildTool gives to a module's rules, as far as LpdeformUnreal.Build.cs uses it. Prints what the rules say.
BUILD_TOOL = """
using System; using System.Collections.Generic;
namespace UnrealBuildTool {
  public enum UnrealTargetPlatform { Win64, Mac, Linux, LinuxArm64, Android }
  public class ReadOnlyTargetRules { public UnrealTargetPlatform Platform; }
  public class BuildException : Exception { public BuildException(string text, object of) : base(string.Format(text, of)) { } }
  public class ModuleRules {
    public enum PCHUsageMode { UseExplicitOrSharedPCHs }
    public PCHUsageMode PCHUsage; public bool bEnableExceptions;
    public static string ModuleDirectory;
    public List<string> PublicDependencyModuleNames = new List<string>(), PrivateDependencyModuleNames = new List<string>(),
      PublicSystemIncludePaths = new List<string>(), PublicAdditionalLibraries = new List<string>(), PublicDelayLoadDLLs = new List<string>(),
      RuntimeDependencies = new List<string>(), PublicRuntimeLibraryPaths = new List<string>();
    public ModuleRules(ReadOnlyTargetRules target) { }
  }
}
static class Print {
  static int Main(string[] arguments) {
    UnrealBuildTool.ModuleRules.ModuleDirectory = arguments[0];
    var platform = (UnrealBuildTool.UnrealTargetPlatform)Enum.Parse(typeof(UnrealBuildTool.UnrealTargetPlatform), arguments[1]);
    try {
      var rules = new LpdeformUnreal(new UnrealBuildTool.ReadOnlyTargetRules { Platform = platform });
      foreach (var file in rules.PublicSystemIncludePaths) Console.WriteLine("include " + file);
      foreach (var file in rules.PublicAdditionalLibraries) Console.WriteLine("link " + file);
      foreach (var file in rules.RuntimeDependencies) Console.WriteLine("ship " + file);
      foreach (var file in rules.PublicDelayLoadDLLs) Console.WriteLine("delay " + file);
      return 0;
    } catch (UnrealBuildTool.BuildException error) { Console.WriteLine(error.Message); return 1; }
  }
}
"""


class Unreal(WithLibraries):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.plugin = cls().pack("unreal", "lpdeform")
        (cls.work / "tool.cs").write_text(BUILD_TOOL)
        subprocess.run(["mcs", "-out:" + str(cls.work / "rules.exe"), cls.work / "tool.cs",
                        cls.plugin / "Source/LpdeformUnreal/LpdeformUnreal.Build.cs"], check=True)

    def rules(self, platform):
        run = subprocess.run(["mono", self.work / "rules.exe", self.plugin / "Source/LpdeformUnreal", platform], capture_output=True, text=True,
                             check=False)
        return run.returncode, [tuple(line.split(" ", 1)) for line in run.stdout.splitlines()]

    def test_the_plugin_names_the_module_that_is_there(self):
        plugin = json.loads((self.plugin / "lpdeform.uplugin").read_text())
        self.assertEqual(plugin["FileVersion"], 3)
        self.assertEqual(plugin["VersionName"], VERSION)
        for module in plugin["Modules"]:
            rules = self.plugin / "Source" / module["Name"] / f"{module['Name']}.Build.cs"
            self.assertIn(f"class {module['Name']} ", rules.read_text())
            sources = "".join(file.read_text() for file in rules.parent.glob("Private/*.cpp"))
            self.assertRegex(sources, rf"IMPLEMENT_MODULE\(\w+, {module['Name']}\)")

    def test_its_pages_need_nothing_else(self):
        self.expect_no_link_leads_outside({str(file.relative_to(self.plugin)): file.read_text(errors="replace")
                                           for file in self.plugin.rglob("*.*") if file.is_file()})

    def test_the_rules_find_all_files_on_each_platform(self):
        for platform in json.loads((self.plugin / "lpdeform.uplugin").read_text())["Modules"][0]["PlatformAllowList"]:
            code, lines = self.rules(platform)
            self.assertEqual(code, 0, lines)
            kinds = [kind for kind, _ in lines]
            self.assertTrue({"include", "link", "ship"} <= set(kinds), lines)
            for kind, file in lines:
                if kind != "delay":
                    self.assertTrue(pathlib.Path(file).exists(), f"{platform}: {kind} {file}")
        for header in ("lpdeform.h", "lpdeform_follower.h"):
            self.assertTrue((self.plugin / "Source/ThirdParty/LpdeformClient/include" / header).exists())

    def test_windows_waits_for_the_library_that_the_module_loads(self):
        self.assertIn(("delay", "liblpdeform_client.dll"), self.rules("Win64")[1])
        self.assertIn("Win64/liblpdeform_client.dll", (self.plugin / "Source/LpdeformUnreal/Private/LpdeformUnrealModule.cpp").read_text())

    def test_the_libraries_are_those_that_were_made(self):
        made = {"Win64": "windows-x86_64", "Linux": "linux-x86_64", "LinuxArm64": "linux-aarch64", "Mac": "macos"}
        shipped = {}
        for folder, platform in made.items():
            files = {kind: pathlib.Path(file) for kind, file in self.rules(folder)[1] if kind in ("link", "ship")}
            self.assertEqual(files["ship"].name, LIBRARIES[platform])
            shipped[platform] = files["ship"].read_bytes()
            self.assertEqual(shipped[platform], library(platform))
            if platform != "windows-x86_64":
                self.assertEqual(files["link"].read_bytes(), library(platform))
        del shipped["macos"]
        self.expect_that_each_loads(shipped)

    def test_the_import_library_is_that_of_the_library(self):
        self.assertEqual((self.plugin / "Source/ThirdParty/LpdeformClient/Win64/lpdeform_client.lib").read_bytes(),
                         library("windows-x86_64", "lpdeform_client.lib"))
        shutil.copytree(self.work / "engine", self.work / "without")
        (self.work / "without/windows-x86_64/out/lpdeform_client.lib").unlink()
        made = subprocess.run([PACKAGE, "unreal", self.work / "no_plugin", "--libraries", self.work / "without"], capture_output=True, text=True,
                              check=False)
        self.assertEqual(made.returncode, 1)
        self.assertIn("lpdeform_client.lib is missing; deploy/engine-library windows-x86_64 makes it", made.stderr)
        self.assertFalse((self.work / "no_plugin").exists())

    def test_other_platforms_are_refused_with_their_name(self):
        code, lines = self.rules("Android")
        self.assertEqual(code, 1)
        self.assertIn("Android", str(lines))


class NuGet(WithLibraries):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with zipfile.ZipFile(cls().pack("nuget", "Lpdeform.nupkg")) as archive:
            cls.files = {name: archive.read(name) for name in archive.namelist()}

    def test_the_manifest_has_id_version_and_licence(self):
        space = {"n": "http://schemas.microsoft.com/packaging/2013/05/nuspec.xsd"}
        metadata = ElementTree.fromstring(self.files["Lpdeform.nuspec"]).find("n:metadata", space)
        self.assertEqual(metadata.findtext("n:id", namespaces=space), "Lpdeform")
        self.assertEqual(metadata.findtext("n:version", namespaces=space), VERSION)
        self.assertEqual(metadata.findtext("n:license", namespaces=space), "Apache-2.0")
        self.assertIn(metadata.findtext("n:readme", namespaces=space), self.files)
        self.assertIn(b'Target="/Lpdeform.nuspec"', self.files["_rels/.rels"])

    def test_its_pages_need_nothing_else(self):
        self.expect_no_link_leads_outside({name: content.decode(errors="replace") for name, content in self.files.items()})

    def test_each_kind_of_file_has_its_content_type(self):
        types = {entry.get("Extension") for entry in ElementTree.fromstring(self.files["[Content_Types].xml"])}
        self.assertLessEqual({name.rsplit(".", 1)[1] for name in self.files} - {"xml"}, types)

    def test_each_system_has_its_library(self):
        made = {"win-x64": "windows-x86_64", "linux-x64": "linux-x86_64", "linux-arm64": "linux-aarch64", "osx": "macos"}
        found = {made[name.split("/")[1]]: content for name, content in self.files.items() if name.startswith("runtimes/")}
        self.assertEqual(found, {platform: library(platform) for platform in made.values()})
        del found["macos"]
        self.expect_that_each_loads(found)
        self.assertIn("runtimes/win-x64/native/lpdeform_client.dll", self.files)  # without lib: the name that .NET looks for

    def test_the_assembly_needs_netstandard_alone(self):
        assembly = self.files["lib/netstandard2.1/Lpdeform.dll"]
        self.assertIn(b"netstandard\0", assembly)
        self.assertNotIn(b"mscorlib", assembly)


class Versions(unittest.TestCase):
    # Where the version of each package stands, and how.
    PLACES = {
        "CMakeLists.txt": r"^project\(lpdeform VERSION ([0-9.]+)",
        "client/python/pyproject.toml": r'^version = "([0-9.]+)"',  # PyPI
        "client/python/src/lpdeform/__init__.py": r'^__version__ = "([0-9.]+)"',
        "client/web/client/package.json": r'^  "version": "([0-9.]+)"',  # npm
        "client/web/viewer/package.json": r'^  "version": "([0-9.]+)"',
        "client/csharp/package.json": r'^  "version": "([0-9.]+)"',  # Unity
        "client/csharp/Lpdeform/AssemblyInfo.cs": r'AssemblyVersion\("([0-9.]+)"\)',  # NuGet has it from CMakeLists.txt
        "client/unreal/lpdeform.uplugin": r'^\t"VersionName": "([0-9.]+)"',
        "client/godot/addons/lpdeform/lpdeform_mesh.gd": r'^const VERSION := "([0-9.]+)"',
        "client/blender/lpdeform_addon/__init__.py": r'^    "version": \(([0-9, ]+)\)',
        "client/blender/lpdeform_addon/blender_manifest.toml": r'^version = "([0-9.]+)"',
        "deploy/kubernetes/kustomization.yaml": r"newTag: ([0-9.]+)",
    }

    def versions(self, root):
        return {place: re.search(pattern, (root / place).read_text(), re.M)[1].replace(", ", ".") for place, pattern in self.PLACES.items()}

    def test_all_packages_have_the_same_version(self):
        self.assertEqual(set(self.versions(ROOT).values()), {VERSION})


if __name__ == "__main__":
    unittest.main(argv=[argument for argument in sys.argv if argument != "real"])
