"""A tab whose fields are options of a command: the texts of its fields are the command's case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from iceslide_fem.app.form import Slider, Texts, chosen, dry_without_meaning, named_in
from iceslide_fem.scene.command_options import CommandOptions, option_name, renamed

SWITCH = {"no": False, "yes": True}  # texts of an option without a value


def slider_of(
    case: type[CommandOptions], starts: Mapping[str, Sequence[float]],
    key: str, label: str, unit: str, scale: float, low: float, high: float,
    log: bool = True, shift: float = 0.0, zero: bool = False,
) -> Slider:  # fmt: skip
    """A slider that begins with the default of its option in `case`, or with that of `starts`."""
    option, _, part = key.partition(".")
    default = case.model_fields[option].default
    start = starts[option][int(part or 0)] if option in starts else default
    shown = float(f"{(start - shift) / scale:.12g}")
    return Slider(key, label, unit, scale, low, high, shown, log, shift, zero)


class Tab(NamedTuple):
    """A tab of the command `name` with the options of `case`.

    A field has the key of its option; an option of several values has a field for each of them,
    "gaussian.0", "gaussian.1". starts: values (SI) of an option where its fields are empty and it
    is among the `needed` ones, or another field has a part of it; sliders; texts: keys and labels;
    choices: key, label and texts, of which the first is chosen at first (keys of no option are the
    page's own); only: choices with which a field has an effect; empty: sliders that begin without a
    value.
    """

    name: str
    case: type[CommandOptions]
    starts: Mapping[str, Sequence[float]]
    needed: Sequence[str]
    sliders: Sequence[Slider]
    texts: Sequence[tuple[str, str]]
    choices: Sequence[tuple[str, str, Sequence[str]]]
    only: Mapping[str, tuple[str, Sequence[str]]]
    empty: Sequence[str] = ()

    def described(self) -> dict[str, Any]:
        """Data of the fields for the page."""
        return {
            "sliders": [slider.described() for slider in self.sliders],
            "texts": self.texts,
            "choices": self.choices,
            "empty": self.empty,
            "only": self.only,
            "help": {key: self._meaning(key) for key in self._keys},
        }

    def options(self, texts: Texts) -> dict[str, Any]:
        """Options of the command by the names of its fields. Raises SceneError for a choice."""
        choices = {key: chosen(texts, key, allowed) for key, _, allowed in self.choices}
        left_out = {key for key, (of, shown) in self.only.items() if choices[of] not in shown}
        left_out |= choices.keys() | dry_without_meaning(texts)
        given = {key: text.strip() for key, text in texts.items() if text.strip()}
        found: dict[str, Any] = {}
        for option in dict.fromkeys([*self.needed, *(key.partition(".")[0] for key in given)]):
            starts = self.starts.get(option, ())
            keys = [f"{option}.{i}" for i in range(len(starts))] if len(starts) > 1 else [option]
            if keys[0] not in left_out:
                values = zip(keys, [repr(start) for start in starts] or [""], strict=True)
                found[option] = ",".join(given.get(key, start) for key, start in values)
        switches = choices.keys() & self.case.model_fields.keys()
        return found | {key: True for key in switches if SWITCH[choices[key]]}

    def values(self, case: CommandOptions) -> dict[str, float | None]:
        """SI values of the sliders; None of those without one."""
        found: dict[str, float | None] = {}
        for slider in self.sliders:
            option, _, part = slider.key.partition(".")
            value = getattr(case, option)
            number = value[int(part or 0)] if isinstance(value, tuple) else value
            nothing = 0.0 if slider.zero else None
            found[slider.key] = float(number) if isinstance(number, int | float) else nothing
        return found

    def fields_in(self, sentence: str) -> list[str]:
        """Keys of the fields whose option or choice a sentence names, before what is allowed."""
        aliases = {key: str(field.alias) for key, field in self.case.model_fields.items()}
        names = {key: aliases.get(option := key.partition(".")[0], option) for key in self._keys}
        named = named_in(sentence.partition(";")[0], list(names.values()))
        return [key for key, name in names.items() if name in named]

    def worded(self, sentence: str) -> str:
        """The sentence with labels of fields in place of the command's options."""
        labels = {slider.key: slider.label for slider in self.sliders} | dict(self.texts)
        labels |= {key: label for key, label, _ in self.choices}
        names = {option_name(key): f'"{label}"' for key, label in labels.items()}
        return renamed(sentence, lambda name: names.get(name, name[2:].replace("-", " ")))

    @property
    def _keys(self) -> list[str]:
        """Keys of all fields."""
        keys = [slider.key for slider in self.sliders]
        return keys + [key for key, _ in self.texts] + [key for key, _, _ in self.choices]

    def _meaning(self, key: str) -> str:
        """What the option of a field means; "" of those of the page's own."""
        field = self.case.model_fields.get(key.partition(".")[0])
        return "" if field is None else field.description or ""

    def snippets(
        self, options: Mapping[str, Any], case: CommandOptions, shown: str
    ) -> dict[str, str]:
        """The command of a case, and Python code that does the same; shown: what it prints."""
        given = "\n".join(f"    {key}={value!r}," for key, value in options.items())
        return {
            "command": case.as_command(self.name),
            "python": f"import iceslide_fem as ice\n\nfound = ice.{self.name}(\n{given}\n)\n"
            f"print({shown})\n",
        }
