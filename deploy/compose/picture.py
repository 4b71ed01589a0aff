"""What the command post's page shows, as one line of JSON; runs in its container, for the compose test."""

import json
import ssl
import sys
import urllib.request
from pathlib import Path

computer = Path("/computers/cp")
trusted = ssl.create_default_context(cafile=str(computer / "keys" / "ca.crt"))
token = (computer / "page.token").read_text().strip()
request = urllib.request.Request(
    f"https://localhost:8080/api/v1/{sys.argv[1]}", headers={"Authorization": f"Bearer {token}"}
)
with urllib.request.urlopen(request, context=trusted, timeout=10) as answer:
    sys.stdout.write(json.dumps(json.load(answer)) + "\n")
