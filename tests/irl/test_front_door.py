import subprocess
import sys

import irl


def run(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_name_loads_from_the_module_that_defines_it():
    for name in irl.__all__:
        value = getattr(irl, name)
        assert getattr(value, "__module__", "irl.").startswith("irl.")
    assert set(irl.__all__) <= set(dir(irl))
    assert set(irl._HOME_OF) == set(irl.__all__)


def test_a_name_that_is_not_there_is_an_attribute_error():
    assert not hasattr(irl, "magic")


def test_importing_it_loads_nothing_heavy_and_a_name_no_more_than_it_needs():
    loaded = "print(*({'torch', 'scipy', 'numpy', 'pydrake', 'matplotlib'} & set(sys.modules)))"
    assert run(f"import sys, irl; irl.__all__, irl.__version__; {loaded}").split() == []
    assert run(f"import sys, irl; irl.InputError; {loaded}").split() == []
    assert "torch" not in run(f"import sys, irl; irl.Demonstrations; {loaded}").split()


def test_it_costs_little_processor_time():
    code = (
        "import time; began = time.process_time(); import irl; "
        "print(irl.__version__, irl.__all__); print(time.process_time() - began)"
    )
    assert min(float(run(code).split()[-1]) for _ in range(3)) < 0.3
