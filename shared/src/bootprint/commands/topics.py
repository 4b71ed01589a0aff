"""`bootprint topics`: the table of topics, for people (it is also docs/topics.md)."""

import sys

import typer

from bootprint.topics import TOPICS, VERSION, Topic

_HEAD = f"""# Topics on the bus

Keys are `{{realm}}/{VERSION}/{{unit}}/{{soldier}}/{{subject}}/{{source}}`, payloads MessagePack maps. This page is
made by `bootprint topics` (`make figures`).

| subject | message | from | care | rate of a source | meaning | fields |
|---|---|---|---|---|---|---|
"""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(topics)


def topics() -> None:
    """Print the table of topics as Markdown: subject, message, who sends it, how often and how carefully."""
    sys.stdout.write(topics_markdown())


def topics_markdown() -> str:
    """The page docs/topics.md."""
    return _HEAD + "".join(_row(topic) for topic in TOPICS)


def _row(topic: Topic) -> str:
    rate = "event" if topic.rate_hz is None else f"{topic.rate_hz:g} Hz"
    fields = ", ".join(f"`{name}`" for name in topic.message.__struct_fields__)
    return (
        f"| `{topic.subject}` | {topic.message.__name__} | {topic.publisher} | {topic.qos.value} | {rate} "
        f"| {topic.meaning} | {fields} |\n"
    )
