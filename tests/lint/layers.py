#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks what the compiler does not: who includes whom, and the form of every source file.

  layers.py [ROOT]        check the sources under ROOT (default: this project); exit 1 and a line for
                          each violation
  layers.py --self-test   break each rule once in a scratch tree and see that it is caught

What a folder may include is the table of ARCHITECTURE.md, "Layers". Tests are free.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

# A module inside a folder of another one comes before that.
MODULES = ("sdk", "capture/simulator", "capture/virtual_camera", "capture", "calibration", "connect/can", "connect/ros2", "connect/web", "apps")

# Folder of sdk -> the folders that it may include, itself aside.
SDK = {"core": set()}
SDK["model"] = {"core"}
SDK["geometry"] = {"core", "model"}
SDK["ambient"] = SDK["motion"] = SDK["wire"] = {"core"}
SDK["stripe"] = {"core", "geometry", "ambient"}
SDK["design"] = {"core", "model", "geometry", "ambient", "stripe"}
SDK["scan"] = {"core", "model", "geometry", "ambient", "stripe"}
SDK["profile"] = {"core", "model", "geometry", "scan"}
SDK["track"] = {"core"}
SDK["compare"] = SDK["detect"] = SDK["guidance"] = SDK["scan"] | {"scan", "profile", "motion", "track"}
SDK["pipeline"] = set(SDK) - {"pipeline", "wire"}
SDK["stream"] = set(SDK)

# What the folders of the other modules may include of sdk; None is everything.
OF_SDK = {"capture/simulator": {"core", "model"}, "capture": {"core", "model", "wire"}, "capture/virtual_camera": {"core"},
          "calibration": SDK["stripe"] | {"model", "geometry", "stripe"}, "connect/can": None, "connect/ros2": None,
          "connect/web": None, "apps": None}
# ... and folders of theirs that may include more.
OF_SDK_IN = {("capture", "scans"): OF_SDK["capture"] | {"scan", "pipeline", "stream"},
             ("capture", "recording"): OF_SDK["capture"] | {"stream"},
             ("capture/simulator", "road"): OF_SDK["capture/simulator"] | {"motion", "guidance"}}
# Folder of another module -> its other folders that it may include; "" is what lies in none, and sees all.
INSIDE = {
    "capture/simulator": {"simulator": set(), "road": {"light"}, "scene": {"simulator"}, "light": {"simulator", "scene"},
                          "view": {"simulator", "scene", "light"}},
    "capture": {"capture": set(), "images": {"capture"}, "live": {"capture"},
                "v4l2": {"capture", "images", "live"}, "gige": {"capture", "live"}, "scans": {"capture"},
                "recording": {"capture"}},
    "capture/virtual_camera": {"virtual_camera": set()},
    "calibration": {"board": set(), "intrinsics": {"board"}, "laser_plane": {"board"},
                    "adjust": {"board", "intrinsics", "laser_plane"}, "validate": {"board", "intrinsics", "adjust"}},
    "connect/can": {"can": set()},
    "connect/ros2": {},
    "connect/web": {"rules": set()},
    "apps": {"examples": set(), "bench": set(), "striper": {"bench"}},
}
INSIDE["calibration"]["session"] = set(INSIDE["calibration"])
INSIDE["calibration"]["report"] = set(INSIDE["calibration"])
# Folder of sources with rooms -> room -> the other rooms that it may include; what lies in none sees all.
ROOMS = {
    "sdk/src/ambient": {"pixels": set(), "illumination": {"pixels"}},
    "sdk/src/stripe": {"profile": set(), "edges": {"profile"}, "noise": {"profile"},
                       "candidates": {"profile", "edges", "noise"}},
    "capture/src/gige": {"protocol": set(), "pictures": {"protocol"}, "clock": {"protocol"},
                         "control": {"protocol", "pictures", "clock"}},
    "capture/src/v4l2": {"device": set(), "format": {"device"}, "buffers": {"device", "format"}},
    "apps/striper": {"program": set(), "options": {"program"}, "run": {"program", "options"}},
}
STRIPE = ROOMS["sdk/src/stripe"]
STRIPE["select"] = set(STRIPE)
STRIPE["learn"] = STRIPE["track"] = set(STRIPE) | {"select"}
STRIPE["report"] = set(STRIPE) | {"learn", "track"}
PROGRAM = ROOMS["apps/striper"]
SHARED = set(PROGRAM)
PROGRAM.update({room: SHARED for room in ("calibrate", "camera", "measure", "design", "follow")})
PROGRAM["record"] = SHARED | {"calibrate"}
PROGRAM["serve"] = SHARED | {"camera", "record"}
PROGRAM["guide"] = SHARED | {"serve"}
OTHER_MODULES = {"sdk": set(), "capture/simulator": set(), "capture": set(), "calibration": set(),
                 "connect/can": set(),
                 "connect/ros2": set(),
                 "connect/web": set(),
                 "capture/virtual_camera": {"capture/simulator"},
                 "apps": {"capture/simulator", "capture", "capture/virtual_camera", "calibration", "connect/can"}}
# ... and what lies in no folder of theirs may include more.
OTHER_MODULES_AT_TOP = {"capture": {"capture/simulator"}}
# Module -> another module and what of its private headers it may include: there is one reader of YAML files, and the virtual
# camera speaks the protocol of GigE Vision from its other end; `bench` times one pass over an image by itself.
YAML_READER = ("sdk", ("core/yaml_",))
BORROWED = {"calibration": YAML_READER, "capture/simulator": YAML_READER,
            "capture/virtual_camera": ("capture", ("gige/protocol", "gige/pictures", "live")),
            "apps": ("sdk", ("stripe/candidates/block_maxima.hpp",))}

# The namespaces of headers: public ones (a `namespace detail` inside them aside), private ones. The formats of messages have a
# namespace of their own, private parts included.
PUBLIC_NAMESPACE = re.compile(r"striper(::wire)?")
PRIVATE_NAMESPACE = re.compile(r"striper::(detail|wire)(::\w+)?")

# Public headers may need only what the targets link publicly.
PUBLIC_LIBRARIES = re.compile(r"(Eigen/|opencv2/core)")
NEVER_IN_LIBRARIES = re.compile(r"\bstd::(cout|cerr|clog|exit|abort|terminate)\b|(?<![\w:.])(printf|puts|exit|abort)\(")
# Each of these is the business of one place.
LIBRARY_HOME = {"ceres/": ("calibration",), "opencv2/calib3d": ("calibration",), "CLI/": ("apps",),
                "arv": ("capture",), "boost/": ("connect/web",), "dds/": ("connect/ros2",), "linux/": ("capture", "connect/can"), "opencv2/highgui": ()}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def tracked(root):
    """The files of the project: git's where it is a clone, all of them in an unpacked archive."""
    listing = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard"], capture_output=True, text=True)
    if listing.returncode == 0:
        return sorted(pathlib.Path(name) for name in listing.stdout.split("\n") if name and (root / name).is_file())
    return sorted(path.relative_to(root) for path in root.rglob("*") if path.is_file() and "build" not in path.parts)


def module_of(path):
    """The module that a file belongs to, empty for none, and its path in there."""
    for module in MODULES:
        if path.is_relative_to(module):
            return module, path.relative_to(module).parts
    return "", path.parts


def folder_of(path):
    """The folder of its module that a file lies in, empty for none."""
    module, parts = module_of(path)
    if module == "apps":
        return parts[0]
    if parts[0] == "include":
        return parts[2]
    return parts[1] if len(parts) > 2 else ""


class Tree:
    def __init__(self, root):
        self.root = root
        self.files = tracked(root)
        self.violations = []
        # <striper/folder/name.hpp> -> module
        self.public = {}
        for path in self.files:
            module, parts = module_of(path)
            if module and parts[0] == "include" and path.suffix == ".hpp":
                self.public["/".join(parts[1:])] = module

    def text(self, path):
        return (self.root / path).read_text(encoding="utf-8", errors="replace")

    def report(self, path, line, message):
        self.violations.append(f"{path}:{line}: {message}")

    def check(self):
        lists = {}
        for path in self.files:
            module, parts = module_of(path)
            if len(parts) == 1 and (path.name == "CMakeLists.txt" or path.suffix == ".cmake"):
                lists[module] = lists.get(module, "") + self.text(path)
        for path in self.files:
            self.check_licence(path)
            if path.suffix not in (".hpp", ".cpp"):
                continue
            self.check_form(path)
            if module_of(path)[0]:
                self.check_listed(path, lists)
                self.check_namespace(path)
                self.check_includes(path)
                self.check_silence(path)
        return self.violations

    def check_licence(self, path):
        is_code = path.suffix in (".hpp", ".cpp", ".py", ".sh", ".cmake") or path.name == "CMakeLists.txt"
        if not is_code:
            return
        lines = self.text(path).split("\n")
        found = [number for number, line in enumerate(lines) if "SPDX-License-Identifier: Apache-2.0" in line
                 and line.lstrip().startswith(("//", "#"))]
        first = 1 if lines[0].startswith("#!") else 0
        if found != [first]:
            self.report(path, 1, "expected one line 'SPDX-License-Identifier: Apache-2.0', the first (after a #! line)")

    def check_form(self, path):
        if not re.fullmatch(r"[a-z0-9_]+(\.hpp|\.cpp|-inl\.hpp)", path.name):
            self.report(path, 1, "file names are lower_case.hpp or lower_case.cpp")
        text = self.text(path)
        if path.name.endswith("-inl.hpp"):
            # Compiled once for every instruction set: included again and again, on purpose.
            if not re.search(r"^#if defined\(\w+_INL_\) == defined\(HWY_TARGET_TOGGLE\)$", text, re.M):
                self.report(path, 1, "expected Highway's include guard, with HWY_TARGET_TOGGLE")
        elif path.suffix == ".hpp":
            if len(re.findall(r"^#pragma once$", text, re.M)) != 1:
                self.report(path, 1, "expected one #pragma once")
            if re.search(r"^\s*using namespace", text, re.M):
                self.report(path, 1, "a header must not say 'using namespace'")

    def check_listed(self, path, lists):
        module, parts = module_of(path)
        if module not in lists or parts[0] not in ("include", "src"):
            return
        is_header = parts[0] == "include"
        if not is_header and path.suffix == ".hpp":
            return
        name = "/".join(parts[1:] if is_header else parts)
        if not re.search(rf"^\s*{re.escape(name)}\s*\)?\s*$", lists[module], re.M):
            self.report(path, 1, f"is not in the {'HEADERS' if is_header else 'SOURCES'} of {module}'s CMake files")

    def check_namespace(self, path):
        """A private part has no name that a public one, or a program, could have."""
        module, parts = module_of(path)
        if module == "apps" or path.suffix != ".hpp":
            return
        allowed = PUBLIC_NAMESPACE if parts[0] == "include" else PRIVATE_NAMESPACE
        for number, line in enumerate(self.text(path).split("\n"), 1):
            found = re.match(r"namespace (striper[\w:]*) \{", line)
            if found and not allowed.fullmatch(found.group(1)):
                self.report(path, number, f"namespace {found.group(1)}: a public header has striper, a private one striper::detail")

    def check_silence(self, path):
        if module_of(path)[0] == "apps":
            return
        for number, line in enumerate(self.text(path).split("\n"), 1):
            code = re.sub(r'"(\\.|[^"\\])*"', '""', line).split("//")[0]
            if NEVER_IN_LIBRARIES.search(code):
                self.report(path, number, f"a library never prints nor ends the program: {line.strip()}")

    def check_includes(self, path):
        for number, line in enumerate(self.text(path).split("\n"), 1):
            match = INCLUDE.match(line)
            if not match:
                continue
            quote, target = match.groups()
            if target.startswith("striper/"):
                self.check_ours(path, number, target, quote)
            elif quote == '"':
                self.check_private(path, number, target)
            else:
                self.check_library(path, number, target)

    def check_ours(self, path, number, target, quote):
        if quote == '"':
            self.report(path, number, f"public headers are included as <{target}>")
        module = self.public.get(target)
        if module is None:
            self.report(path, number, f"there is no public header {target}")
            return
        self.check_may(path, number, module, target.split("/")[1], target)

    def check_private(self, path, number, target):
        module, parts = module_of(path)
        if parts[0] == "include":
            self.report(path, number, f"a public header must not include a private one: {target}")
            return
        for base in (self.root / module / "src", (self.root / path).parent, self.root / module / parts[0], self.root / module):
            if (base / target).is_file():
                other = (base / target).relative_to(self.root)
                self.check_may(path, number, module, folder_of(other), target)
                self.check_room(path, number, other.parts)
                return
        lender, folders = BORROWED.get(module, ("", ()))
        if not target.startswith(folders) or not (self.root / lender / "src" / target).is_file():
            self.report(path, number, f"there is no private header {target} in {module}")

    def check_room(self, path, number, parts):
        """Of two files of one folder with rooms: the table of ROOMS."""
        floor = next((f for f in ROOMS if "/".join(parts).startswith(f + "/")), None)
        if floor is None or not path.is_relative_to(floor):
            return
        table, level = ROOMS[floor], floor.count("/") + 1
        if len(path.parts) < level + 2:
            return
        own, other = path.parts[level], parts[level] if len(parts) > level + 1 else ""
        if own not in table:
            self.report(path, number, f"room {own} is not in the table of rooms")
        elif other != own and other not in table[own]:
            self.report(path, number, f"{own} must not include {other or 'what sees all'} of {parts[level - 1]}: {'/'.join(parts[level:])}")

    def check_may(self, path, number, module, folder, target):
        own, inside = module_of(path)[0], folder_of(path)
        if own == module:
            table = SDK if own == "sdk" else INSIDE[own]
            if inside == "" and own != "sdk":
                return
            if inside not in table:
                self.report(path, number, f"folder {inside} is not in the table of layers")
            elif folder != inside and folder not in table[inside]:
                self.report(path, number, f"{inside} must not include {folder or 'what sees all'}: {target}")
            return
        if module == "sdk":
            allowed = OF_SDK_IN.get((own, inside), OF_SDK[own])
            if allowed is not None and folder not in allowed:
                self.report(path, number, f"{own} must not include {folder} of sdk: {target}")
            return
        at_top = OTHER_MODULES_AT_TOP.get(own, set()) if inside == "" else set()
        if module not in OTHER_MODULES[own] | at_top:
            self.report(path, number, f"{own} must not include {module}: {target}")

    def check_library(self, path, number, target):
        module, parts = module_of(path)
        is_ours_alone = "/" not in target and not target.endswith(".h")
        if parts[0] == "include" and not is_ours_alone and not PUBLIC_LIBRARIES.match(target):
            self.report(path, number, f"a public header must not need <{target}>: only the standard library, Eigen and opencv2/core")
        for prefix, homes in LIBRARY_HOME.items():
            if target.startswith(prefix) and module not in homes:
                self.report(path, number, f"<{target}> is for {' and '.join(homes) or 'nobody'}, not for {module}")


def self_test():
    spdx = "// SPDX-License-Identifier: Apache-2.0\n"
    header = spdx + "#pragma once\n"
    good = {
        "sdk/CMakeLists.txt": "# SPDX-License-Identifier: Apache-2.0\n striper/core/a.hpp\n striper/model/b.hpp\n"
                              " striper/scan/c.hpp\n src/core/a.cpp\n src/scan/c.cpp\n src/ambient/pixels/p.cpp\n",
        "capture/CMakeLists.txt": "# SPDX-License-Identifier: Apache-2.0\n striper/capture/d.hpp\n src/d.cpp\n src/images/i.cpp\n",
        "sdk/include/striper/core/a.hpp": header + "#include <string>\n#include <Eigen/Core>\n",
        "sdk/include/striper/model/b.hpp": header + "#include <striper/core/a.hpp>\n",
        "sdk/include/striper/scan/c.hpp": header + "#include <striper/model/b.hpp>\n",
        "sdk/src/core/a.cpp": spdx + '#include "core/p.hpp"\n// std::cout is not for us\n',
        "sdk/src/core/p.hpp": header,
        "sdk/src/core/k-inl.hpp": spdx + "#if defined(K_INL_) == defined(HWY_TARGET_TOGGLE)\n#endif\n",
        "sdk/src/scan/q.hpp": header,
        "sdk/src/scan/c.cpp": spdx + '#include "core/p.hpp"\n#include "scan/q.hpp"\n',
        "capture/include/striper/capture/d.hpp": header + "#include <striper/core/a.hpp>\n",
        "capture/src/d.cpp": spdx + "#include <striper/capture/d.hpp>\n#include <striper/simulator/s.hpp>\n",
        "capture/src/v4l2/v.hpp": header,
        "sdk/src/ambient/illumination/i.hpp": header,
        "sdk/src/ambient/pixels/p.cpp": spdx,
        "capture/src/images/i.cpp": spdx,
        "capture/src/gige/protocol/g.hpp": header,
        "capture/simulator/CMakeLists.txt": "# SPDX-License-Identifier: Apache-2.0\n striper/simulator/s.hpp\n src/light/l.cpp\n",
        "capture/simulator/include/striper/simulator/s.hpp": header + "#include <striper/core/a.hpp>\n",
        "capture/simulator/src/light/l.cpp": spdx + '#include "scene/w.hpp"\n#include <striper/simulator/s.hpp>\n',
        "capture/simulator/src/scene/w.hpp": header,
        "capture/simulator/src/view/v.hpp": header,
        "capture/virtual_camera/CMakeLists.txt": "# SPDX-License-Identifier: Apache-2.0\n src/c.cpp\n",
        "capture/virtual_camera/src/c.cpp": spdx + '#include "gige/protocol/g.hpp"\n#include <striper/simulator/s.hpp>\n',
        "apps/striper/main.cpp": spdx + '#include <striper/scan/c.hpp>\n#include <striper/capture/d.hpp>\n#include "m.hpp"\n',
        "apps/striper/m.hpp": header,
    }
    bad = {
        "core must not include model": ("sdk/src/core/a.cpp", "#include <striper/model/b.hpp>\n"),
        "model must not include scan": ("sdk/include/striper/model/b.hpp", "#include <striper/scan/c.hpp>\n"),
        "core must not include scan: scan/q.hpp": ("sdk/src/core/a.cpp", '#include "scan/q.hpp"\n'),
        "pixels must not include illumination": ("sdk/src/ambient/pixels/p.cpp", '#include "ambient/illumination/i.hpp"\n'),
        "images must not include v4l2": ("capture/src/images/i.cpp", '#include "v4l2/v.hpp"\n'),
        "capture must not include scan of sdk": ("capture/src/d.cpp", "#include <striper/scan/c.hpp>\n"),
        "light must not include view": ("capture/simulator/src/light/l.cpp", '#include "view/v.hpp"\n'),
        "capture must not include capture/simulator": ("capture/src/images/i.cpp", "#include <striper/simulator/s.hpp>\n"),
        "capture/simulator must not include capture": ("capture/simulator/src/light/l.cpp", "#include <striper/capture/d.hpp>\n"),
        "there is no private header v4l2/v.hpp in capture/virtual_camera":
            ("capture/virtual_camera/src/c.cpp", '#include "v4l2/v.hpp"\n'),
        "sdk must not include capture": ("sdk/src/scan/c.cpp", "#include <striper/capture/d.hpp>\n"),
        "must not include a private one": ("sdk/include/striper/scan/c.hpp", '#include "scan/q.hpp"\n'),
        "there is no public header": ("sdk/src/core/a.cpp", "#include <striper/core/none.hpp>\n"),
        "there is no private header": ("sdk/src/core/a.cpp", '#include "core/none.hpp"\n'),
        "included as <striper/core/a.hpp>": ("sdk/src/core/a.cpp", '#include "striper/core/a.hpp"\n'),
        "must not need <fmt/format.h>": ("sdk/include/striper/core/a.hpp", "#include <fmt/format.h>\n"),
        "<ceres/ceres.h> is for calibration": ("sdk/src/core/a.cpp", "#include <ceres/ceres.h>\n"),
        "never prints": ("sdk/src/core/a.cpp", "void f() { std::cout << 1; }\n"),
        "namespace striper::detail: a public": ("sdk/include/striper/core/a.hpp", "namespace striper::detail {\n"),
        "namespace striper: a public": ("sdk/src/core/p.hpp", "namespace striper {\n"),
        "namespace striper::v4l2: a public": ("capture/src/v4l2/v.hpp", "namespace striper::v4l2 {\n"),
        "'using namespace'": ("sdk/include/striper/core/a.hpp", "using namespace std;\n"),
        "one #pragma once": ("sdk/src/core/p.hpp", "#pragma once\n"),
        "Highway's include guard": ("sdk/src/core/l-inl.hpp", header),
        "expected one line 'SPDX": ("sdk/src/core/p.hpp", "// SPDX-License-Identifier: Apache-2.0\n"),
        "HEADERS of sdk's": ("sdk/include/striper/core/new.hpp", header),
        "SOURCES of capture's": ("capture/src/new.cpp", spdx),
        "file names are": ("tests/Bad.cpp", spdx),
        "not in the table of layers": ("sdk/src/novel/n.hpp", header + "#include <striper/core/a.hpp>\n"),
    }

    def violations(extra=None):
        with tempfile.TemporaryDirectory() as scratch:
            root = pathlib.Path(scratch)
            for name, text in good.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            if extra:
                path = root / extra[0]
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text((path.read_text() if path.exists() else "") + extra[1])
            return Tree(root).check()

    failures = [f"clean tree: {line}" for line in violations()]
    for expected, extra in bad.items():
        found = violations(extra)
        if len(found) != 1 or expected not in found[0]:
            failures.append(f"expected one violation with '{expected}', found {found}")
    for line in failures:
        print(line, file=sys.stderr)
    return 1 if failures else 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    if sys.argv[1:] and sys.argv[1].startswith("-"):
        print(__doc__)
        return 0 if sys.argv[1] in ("-h", "--help") else 2
    root = pathlib.Path(sys.argv[1]) if sys.argv[1:] else pathlib.Path(__file__).resolve().parents[2]
    violations = Tree(root).check()
    for line in violations:
        print(line, file=sys.stderr)
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main())
