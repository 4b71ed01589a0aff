"""Height from air pressure and steps: climbs and floors."""
