"""Tab completion: the words that are offered, in Python and by the function of each shell."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest

from isethdr_core.cli.commands import app
from isethdr_core.cli.completion import SHELLS, cache_file, complete, script, vocabulary
from isethdr_core.config.main_config import settings
from isethdr_core.plugins.component import KINDS
from isethdr_core.storage.store import write_store

# command of a shell that runs `isethdr` of this working tree
COMMAND = f'{sys.executable} -c "from isethdr_core.cli.commands import main; main()"'
ASKED = "isethdr run sensor=single_m"
ANSWER = "sensor=single_mt9v024"


def test_the_words_of_the_command_line():
    assert complete(app, ["pl"]) == ["plan", "plugins"] and "catalog" in complete(app, [""])
    assert complete(app, ["catalog", "com"]) == ["compare"]
    assert complete(app, ["plugins", "sens"]) == ["sensor"]
    assert "bayer_imx363" in complete(app, ["plugins", "sensor", "bayer"])
    assert complete(app, ["run", "--mul"]) == ["--multirun"]
    assert "--dry-run" in complete(app, ["catalog", "gc", "--d"])
    assert complete(app, ["plugins", "sensor", "bayer", ""]) == []
    assert complete(app, ["new-plugin", "sen"]) == ["sensor"]
    assert complete(app, ["new-plugin", "sensor", "ba"]) == []


def test_the_words_of_an_override():
    every = complete(app, ["run", ""])
    assert {f"{kind}=" for kind in KINDS} | {f"{s.name}=" for s in settings()} <= set(every)
    assert complete(app, ["run", "sensor=single_m"]) == [ANSWER], "a preset"
    assert complete(app, ["run", "sensor=bayer,single_m"]) == ["sensor=bayer,single_mt9v024"]
    assert complete(app, ["run", "experiment=night_drive_t"]) == ["experiment=night_drive_typical"]
    assert complete(app, ["run", "~ren"]) == ["~renderer"]


def test_fields_are_those_of_what_was_chosen():
    assert complete(app, ["run", "sensor=staggered_four", "sensor.exposure_ra"]) == [
        "sensor.exposure_ratios="
    ]
    assert complete(app, ["run", "sensor=bayer", "sensor.exposure_ra"]) == []
    assert complete(app, ["run", "cameras.rgbw.exposure_r"]) == ["cameras.rgbw.exposure_rule="]
    assert complete(app, ["run", "sensor=bayer", "sensor.exposure_rule=hi"]) == [
        "sensor.exposure_rule=histogram",
        "sensor.exposure_rule=highlights",
    ]
    added = ["run", "+metric@metric.mine=ssim", "metric.mine.white"]
    assert complete(app, added) == ["metric.mine.white_cd_m2="]
    assert complete(app, ["plan", "lens.f_num"]) == ["lens.f_number="], "of the main config"


def test_runs_are_offered_where_a_run_is_expected(isethdr_home):
    write_store(isethdr_home / "runs", "1f3a", {}, {"kind": "run", "cameras": []})
    for before in (["catalog", "compare"], ["catalog", "report"], ["reproduce"]):
        assert complete(app, [*before, "1"]) == ["1f3a"]
    assert complete(app, ["catalog", "find", "1"]) == []


def test_the_words_are_kept_until_a_file_changes(monkeypatch):
    words = vocabulary(app)
    kept = cache_file().read_text()
    monkeypatch.setattr("isethdr_core.cli.vocabulary.collected", None)  # would raise if called
    assert vocabulary(app) == words
    cache_file().write_text(kept.replace('"state": "', '"state": "0'))
    with pytest.raises(TypeError):
        vocabulary(app)


def in_shell(shell: str, text: str, *arguments: str) -> str:
    """Return what a shell prints for a script, with `isethdr` of this working tree."""
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    environment = {**os.environ, "HOME": os.environ.get("ISETHDR_CACHE", "/")}
    done = subprocess.run(
        [shell, *arguments, "-c", text], env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout


def test_the_function_of_bash():
    vocabulary(app)
    text = f"""
isethdr() {{ {COMMAND} "$@"; }}
{script("bash")}
COMP_LINE='{ASKED}'; COMP_POINT=${{#COMP_LINE}}
_isethdr; printf '%s\\n' "${{COMPREPLY[@]}}"
COMP_LINE='isethdr run '; COMP_POINT=${{#COMP_LINE}}
_isethdr; printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    first, *others = in_shell("bash", text).splitlines()
    assert first == "single_mt9v024", "readline keeps what stands before the ="
    assert "lens=" in others


@pytest.mark.slow
def test_the_function_of_zsh():
    vocabulary(app)
    text = f"""
isethdr() {{ {COMMAND} "$@"; }}
compdef() {{ }}
compadd() {{ [[ $1 == -S ]] && shift 2; print -l -- ${{(P)2}}; }}
{script("zsh")}
words=({ASKED}); CURRENT=3
_isethdr
words=(isethdr run len); CURRENT=3
_isethdr
"""
    assert in_shell("zsh", text, "-f").split() == [ANSWER, "lens=", "lens."]


def test_the_function_of_fish():
    vocabulary(app)
    text = f"""
function isethdr; {COMMAND} $argv; end
{script("fish")}
complete -C '{ASKED}'
"""
    assert in_shell("fish", text).split() == [ANSWER]


def test_every_shell_has_a_script():
    assert all("isethdr complete --" in script(shell) for shell in SHELLS)
